"""Imports go one way, in the order of docs/architecture.rst, and slow packages stay out."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

import gso

ROOT = Path(__file__).resolve().parents[1]
DOC = (ROOT / "docs" / "architecture.rst").read_text()


def table(number: int) -> list[tuple[list[str], str]]:
    """Names in the first column of a table of docs/architecture.rst, and its second column."""
    part = DOC.split(".. list-table::")[number + 1]
    rows = re.findall(r"^   \* - (.*)\n     - (.*(?:\n       .*)*)", part, re.M)[1:]
    return [(re.findall(r"``([\w.]+)``", first), second) for first, second in rows]


LAYERS = [names for names, _ in table(0)]
ROW = {name: k for k, names in enumerate(LAYERS) for name in names}
OWNERS = {names[0]: re.findall(r"``([\w.]+)``", second) for names, second in table(1)}
MODULES = {
    ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): path
    for path in sorted((ROOT / "gso").rglob("*.py"))
}


def imports(path: Path, skipped: ast.AST | None = None) -> set[str]:
    """Modules that a file imports, anywhere in it but in a node."""
    found = set()
    left_out = set() if skipped is None else {ast.unparse(n) for n in ast.walk(skipped)}
    for node in ast.walk(ast.parse(path.read_text())):
        if left_out and isinstance(node, ast.stmt) and ast.unparse(node) in left_out:
            continue
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            names = {f"{node.module}.{alias.name}" for alias in node.names}
            found |= {n if n in MODULES else str(node.module) for n in names}
    return found


@cache
def every_import() -> dict[str, set[str]]:
    """What each module imports, by its name."""
    return {name: imports(path) for name, path in MODULES.items()}


def part(module: str) -> str:
    """The row name that a module belongs to: the longest one that begins its name."""
    own = module.removeprefix("gso").removeprefix(".")
    while own not in ROW and "." in own:
        own = own.rpartition(".")[0]
    return own


def reached(module: str) -> set[str]:
    """Everything that a module imports, directly or through other modules of the package."""
    found: set[str] = set()
    ahead = {module}
    while ahead:
        name = ahead.pop()
        new = every_import().get(name, set()) - found
        found |= new
        ahead |= new
    return found


def test_table_is_read():
    assert ROW["status"] == 0
    assert ROW["__main__"] == ROW["cli"] + 1 == len(LAYERS) - 1
    assert OWNERS["casadi"] == ["solver.kernels", "solver.printing"]


def test_every_module_has_a_place():
    assert {part(m) for m in MODULES} - {""} == set(ROW)


def test_package_itself_imports_nothing():
    nodes = ast.parse(MODULES["gso"].read_text()).body
    checked = next(n for n in nodes if isinstance(n, ast.If))
    assert ast.unparse(checked.test) == "TYPE_CHECKING"
    own = {n.split(".")[0] for n in imports(MODULES["gso"], skipped=checked)}
    assert own <= {"__future__", "importlib", "typing"}


def test_type_checkers_see_every_public_name():
    nodes = ast.parse(MODULES["gso"].read_text()).body
    block = next(n for n in nodes if isinstance(n, ast.If))
    seen = {
        a.asname or a.name for n in block.body if isinstance(n, ast.ImportFrom) for a in n.names
    }
    assert seen | {"__version__"} == set(gso.__all__)


@pytest.mark.parametrize("module", [m for m in MODULES if m != "gso"])
def test_imports_come_from_above(module):
    for name in every_import()[module]:
        if name.split(".")[0] != "gso" or part(name) == part(module):
            continue
        if name == "gso":
            # Its names are those of any layer: only the last one may use them.
            assert part(module) == "cli"
        else:
            assert ROW[part(name)] < ROW[part(module)], f"{module} imports {name}"


@pytest.mark.parametrize("package", OWNERS)
def test_slow_packages_have_owners(package):
    users = {
        name.removeprefix("gso.")
        for name, found in every_import().items()
        if any(f.split(".")[0] == package for f in found)
    }
    assert users == set(OWNERS[package])


@pytest.mark.parametrize(
    ("where", "banned"),
    [
        ("tno", {"gso.net", "torch"}),
        ("solver", {"gso.net", "torch"}),
        ("tno.batched", {"gso.net"}),
        ("net", {"gso.tno", "casadi"}),
        *((name, {"casadi", "torch"}) for name in ("geometry", "energy", "metrics", "mesh")),
    ],
)
def test_banned_imports(where, banned):
    for module in MODULES:
        if part(module) == where:
            found = reached(module)
            hits = {f for f in found for b in banned if f == b or f.startswith(f"{b}.")}
            assert not hits, f"{module} imports {hits}"


def run(code: str) -> str:
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return done.stdout.strip()


SLOW = "{'numpy', 'scipy', 'casadi', 'torch', 'matplotlib', 'igl', 'trimesh', 'click', 'tqdm'}"


def test_importing_the_package_costs_nothing():
    code = (
        "import sys, time; t = time.process_time(); import gso; t = time.process_time() - t\n"
        f"print(sorted({SLOW} & set(sys.modules)), t < 0.1)"
    )
    assert run(code) == "[] True"


@pytest.mark.parametrize("name", ["geometry", "energy", "metrics", "tasks", "mesh", "io", "tno"])
def test_importing_a_part_loads_no_slow_package(name):
    code = f"import sys, gso.{name}\nprint(sorted(({SLOW} - {{'numpy'}}) & set(sys.modules)))"
    assert run(code) == "[]"


def test_public_names_exist():
    import gso

    for name in gso.__all__:
        if name != "__version__":
            assert getattr(gso, name) is not None


def test_tests_import_faces():
    """Few tests name an inner module: one that is not the ``__init__.py`` of a package."""
    faces = {name for name, path in MODULES.items() if path.name == "__init__.py"}
    named = {name for path in (ROOT / "tests").rglob("*.py") for name in imports(path)}
    inner = (named & MODULES.keys()) - faces
    assert len(inner) <= 40, sorted(inner)
