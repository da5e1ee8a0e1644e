"""Damaged files and meshes at random: a finite result or an error of the package, nothing else.

Every case is made from its number alone, so that a failure can be repeated. With
``GSO_EXHAUSTIVE=1`` in the environment there are eight times as many.
"""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
import pytest

import gso
from gso import GSOError, Mesh, tasks
from gso.mesh import topology
from tests.conftest import EXHAUSTIVE, saddle

#: Cases from each first number of the slow tests.
MANY = 400 if EXHAUSTIVE else 50
#: Words that files should not have.
ODD = ["nan", "inf", "-inf", "1e308", "-1e200", "1e-320", "0", "-1", "99999999999", "x", "", "1e5"]
#: Numbers that meshes should not have; NaN and inf are refused, which takes no time.
SIZES = [0.0, 1e-12, 1e-6, -1.0, 1e3, 1e6, 1e12, 1e90, 1e160, np.nan, np.inf]


def bases() -> dict[str, Mesh]:
    """Small meshes of every kind."""
    grid = Mesh.from_grid(saddle(4, 5))
    quads = Mesh(grid.vertices, grid.faces[[0, 1, 2, 4, 5, 6, 9, 10]])
    mixed = [[0, 1, 6, -1], [0, 6, 5, -1], *grid.faces[3:].tolist()]
    two = np.r_[grid.vertices, grid.vertices + np.array([0, 0, 9])]
    return {
        "grid": grid,
        "quads": quads,
        "mixed": Mesh(grid.vertices, mixed),
        "triangles": Mesh(grid.vertices, grid.triangles),
        "two": Mesh(two, np.r_[grid.faces, grid.faces + 20]),
    }


def mutated_bytes(data: bytes, rng: np.random.Generator) -> bytes:
    """Some bytes changed, doubled, left out, or the end cut off."""
    for _ in range(rng.integers(1, 3)):
        at, end = np.sort(rng.integers(0, len(data) + 1, 2))
        end = min(end, at + 40)
        match rng.integers(5):
            case 0:
                data = data[:at] + data[end:]
            case 1:
                data = data[:end] + data[at:end] + data[end:]
            case 2:
                data = data[:at] + rng.bytes(int(rng.integers(1, 9))) + data[at:]
            case 3:
                data = data[:at] + bytes([rng.integers(256)]) + data[at + 1 :]
            case 4 if rng.random() < 0.3:
                data = data[:at]
    return data


def mutated_text(data: bytes, rng: np.random.Generator) -> bytes:
    """Some lines or words changed, doubled, exchanged or left out."""
    lines = [line.split(" ") for line in data.decode("latin-1").split("\n")]
    for _ in range(rng.integers(1, 3)):
        k, other = rng.integers(0, len(lines), 2)
        word = int(rng.integers(0, len(lines[k])))
        match rng.integers(7):
            case 0:
                lines[k] = []
            case 1:
                lines.insert(int(other), list(lines[k]))
            case 2:
                lines[k], lines[other] = lines[other], lines[k]
            case 3:
                lines[k] = lines[k][:word] + lines[k][word + 1 :]
            case 4:
                lines[k] = [*lines[k][:word], str(rng.choice(ODD)), *lines[k][word + 1 :]]
            case 5:
                lines[k] = [*lines[k][: word + 1], "\n", *lines[k][word + 1 :]]
            case 6:
                lines[k] = [*lines[k], *lines[other]]
    return "\n".join(" ".join(line) for line in lines).encode("latin-1")


def mutated_mesh(mesh: Mesh, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Faces left out, vertices moved, merged, blown up, exchanged, or components added."""
    points, faces = mesh.vertices.copy(), mesh.faces.copy()
    for _ in range(rng.integers(1, 4)):
        some = rng.integers(0, len(points), rng.integers(1, 4))
        size = float(rng.choice(SIZES))
        match rng.integers(8):
            case 0:
                keep = rng.random(len(faces)) < rng.uniform(0.1, 1)
                faces = faces[keep]
            case 1:
                points[some] *= size
            case 2:
                points[some] += size * rng.standard_normal((some.size, 3))
            case 3:
                points = points + size * rng.standard_normal(3)
            case 4:
                points[some] = points[some[0]]
            case 5:
                points = points * size
            case 6 if len(faces):
                k = rng.integers(len(faces))
                faces[k, rng.integers(3)] = rng.integers(0, len(points))
            case 7 if len(faces):
                k = rng.integers(len(faces))
                faces = np.r_[faces, faces[[k]] + len(points)]
                points = np.r_[points, points + rng.standard_normal(3)]
    return points, faces


def scattered(rng: np.random.Generator) -> Mesh:
    """Some faces of a 9 x 9 grid that touch along edges or not at all."""
    faces = topology.grid_faces(9, 9)[rng.permutation(64)]
    wanted, taken = int(rng.integers(2, 30)), []
    points = saddle(9).reshape(-1, 3)
    for face in faces:
        try:
            Mesh(points, [*taken, face])
        except GSOError:
            continue
        taken.append(face)
        if len(taken) == wanted:
            break
    return Mesh(points + 0.01 * rng.standard_normal(points.shape), taken)


PLANS = [
    (task, formulation) for task in tasks.names() for formulation in tasks.get(task).formulations
]


def solved(mesh, number: int) -> bool:
    """Solve by one of the tasks; whatever comes is finite, or an error of the package.

    Returns whether there was a result.
    """
    task, formulation = PLANS[number % len(PLANS)]
    options = tasks.get(task).formulations[formulation].options.preset("fast")
    try:
        result = gso.tno.optimize(
            mesh, task=task, formulation=formulation, options=replace(options, iterations=3)
        )
    except GSOError as error:
        assert str(error)
        return False
    used = result.design.used
    if result.pattern is not None and result.flat is None:
        # What was cut open has the vertices of its pattern.
        assert np.isfinite(result.pattern.flat).all()
    else:
        assert np.isfinite(result.on_design().vertices[used]).all()
    known = slice(None) if result.ruled is not None else used
    assert result.flat is None or np.isfinite(result.flat[known]).all()
    assert isinstance(result.usable, bool)
    return True


@pytest.fixture(autouse=True)
def warnings_are_fine():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


@pytest.fixture(scope="module")
def originals(tmp_path_factory):
    """Content of files of every format."""
    folder = tmp_path_factory.mktemp("originals")
    found = []
    for suffix in gso.io.SUFFIXES:
        for name, mesh in bases().items():
            if suffix == ".npy" and mesh.grid is None:
                continue
            gso.save(mesh, folder / f"{name}{suffix}")
            found.append((suffix, (folder / f"{name}{suffix}").read_bytes()))
    facets = "".join(
        "facet normal 0 0 1\nouter loop\n"
        + "".join("vertex {} {} {}\n".format(*p) for p in corners.tolist())
        + "endloop\nendfacet\n"
        for corners in bases()["triangles"].vertices[bases()["triangles"].faces]
    )
    found.append((".stl", f"solid a\n{facets}endsolid a\n".encode()))
    points = "".join("{} {} {}\n".format(*p) for p in saddle(3).reshape(-1, 3).tolist())
    rows = "".join("4 {} {} {} {}\n".format(*f) for f in topology.grid_faces(3, 3).tolist())
    head = "ply\nformat ascii 1.0\nelement vertex 9\nproperty float x\nproperty float y\n"
    head += "property float z\nelement face 4\nproperty list uchar int vertex_indices\nend_header\n"
    found.append((".ply", (head + points + rows).encode()))
    named = "mtllib a.mtl\n" + "".join(f"v {p}\nvt {p}\n" for p in points.split("\n")[:-1])
    for k, f in enumerate((topology.grid_faces(3, 3) + 1).tolist()):
        named += f"g part {k // 2}\nusemtl m{k}\nf " + " ".join(f"{c}/{c}" for c in f) + "\n"
    found.append((".obj", named.encode()))
    return found


def files(originals, path, numbers) -> int:
    """Load mutated files and solve what can be read; how many could."""
    loaded = 0
    for number in numbers:
        rng = np.random.default_rng([1, number])
        suffix, data = originals[number % len(originals)]
        text = b"\0" not in data and rng.random() < 0.8
        path = path.with_suffix(suffix)
        path.write_bytes((mutated_text if text else mutated_bytes)(data, rng))
        try:
            mesh = gso.load(path, weld=None if rng.random() < 0.8 else 10 ** rng.uniform(-6, 0))
        except GSOError as error:
            assert str(error).startswith(f"{path}: ")
            continue
        loaded += 1
        assert np.isfinite(mesh.vertices).all()
        with np.errstate(all="ignore"):
            solved(mesh, int(rng.integers(1000)))
        gso.save(mesh, path.with_suffix(".obj"))
    return loaded


def surfaces(numbers) -> int:
    """Solve mutated meshes; how many gave a result."""
    kinds, count = list(bases().values()), 0
    for number in numbers:
        rng = np.random.default_rng([2, number])
        if rng.random() < 0.3:
            mesh = scattered(rng)
        else:
            mesh = mutated_mesh(kinds[rng.integers(len(kinds))], rng)
        count += solved(mesh, int(rng.integers(1000)))
    return count


def test_mutated_files(originals, tmp_path):
    assert files(originals, tmp_path / "a", range(150)) > 20


@pytest.mark.parametrize("start", range(0, 150, 50))
def test_mutated_meshes(start):
    assert surfaces(range(start, start + 50)) > 15


@pytest.mark.parametrize("number", [1356, 1463, 1513, 2287, 2455])
def test_meshes_that_were_too_large_for_their_strains(number):
    surfaces([number])


def test_a_file_that_was_too_large_to_be_welded(originals, tmp_path):
    files(originals, tmp_path / "a", [1032])


@pytest.mark.slow
@pytest.mark.parametrize("start", range(200, 3000, 400))
def test_many_mutated_files(start, originals, tmp_path):
    files(originals, tmp_path / "a", range(start, start + MANY))


@pytest.mark.slow
@pytest.mark.parametrize("start", range(200, 3000, 800))
def test_many_mutated_meshes(start):
    assert surfaces(range(start, start + MANY)) > 0.3 * MANY


@pytest.mark.parametrize("formulation", tasks.get("denoise").formulations)
def test_faces_scattered_among_many_vertices_are_denoised(formulation):
    for seed in range(12):
        mesh = scattered(np.random.default_rng(seed))
        result = gso.tno.optimize(mesh, task="denoise", formulation=formulation)
        assert np.isfinite(result.mesh.vertices).all()
        moved = result.mesh.vertices - mesh.vertices
        assert np.abs(moved[~mesh.used]).max() < 1e-12


def test_unused_vertices_change_nothing_in_denoising():
    rng = np.random.default_rng(0)
    points = saddle(9).reshape(-1, 3) + 0.02 * rng.standard_normal((81, 3))
    faces = topology.grid_faces(9, 9)[:-1]
    plain = gso.tno.optimize((points, faces), task="denoise")
    more = np.r_[points, rng.uniform(-1e3, 1e3, (500, 3))]
    with_unused = gso.tno.optimize((more, faces), task="denoise")
    assert np.allclose(with_unused.mesh.vertices[:81], plain.mesh.vertices, rtol=0, atol=1e-12)
    assert with_unused.details["dof"] == pytest.approx(plain.details["dof"])
    assert with_unused.details["sigma"] == pytest.approx(plain.details["sigma"])
