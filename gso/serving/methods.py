"""Methods of the server: each calls the function that its command calls, with the same keywords."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from gso.errors import OptionError
from gso.io.json_file import plain
from gso.serving.flat_record import mesh_record, net_record, part_record, pattern_record
from gso.serving.given_mesh import GivenMesh
from gso.serving.progress_lines import ProgressLines
from gso.serving.protocol import PROTOCOL
from gso.spelling import check_keywords, choices
from gso.typing import Json, Keywords

if TYPE_CHECKING:
    from gso.mesh import Mesh
    from gso.pattern import Folded, Pattern
    from gso.workshop.panels import Made

#: Parameters that say what the surface is, and where drawings of the parts are written.
_MESH = ("mesh", "weld", "chord")
_DRAWN = ("output", "name")
#: Keywords of functions that are Python objects.
_OBJECTS = frozenset(("callback", "x0", "terms", "scheduler", "marks", "holes", "verdict"))


@dataclass(frozen=True)
class Method:
    """A method.

    Attributes
    ----------
    run : callable
        Called with the parameters and the progress; returns the result.
    own : tuple of str
        Parameters that are no keywords of the function.
    function : str
        Module and name of the function whose keywords are parameters; empty for none.
    left_out : frozenset of str
        Keywords of it that are no parameters.
    """

    run: Callable[[Json, ProgressLines], Json]
    own: tuple[str, ...]
    function: str = ""
    left_out: frozenset[str] = _OBJECTS

    @property
    def keywords(self) -> tuple[str, ...]:
        """Keywords of the function that are parameters."""
        if not self.function:
            return ()
        module, name = self.function.split(":")
        given = inspect.signature(getattr(import_module(module), name)).parameters.values()
        named = (p.name for p in given if p.kind is inspect.Parameter.KEYWORD_ONLY)
        return tuple(name for name in named if name not in self.left_out)

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of all parameters."""
        return tuple(dict.fromkeys((*self.own, *self.keywords)))


def call(name: str, params: Json, progress: ProgressLines) -> Json:
    """Run a method.

    Raises
    ------
    GSOError
        There is no such method or parameter, or the function raises it.
    Cancelled
        The request was cancelled.
    """
    if name not in METHODS:
        raise OptionError(f"there is no method {name!r}; {choices(name, METHODS)}")
    method = METHODS[name]
    check_keywords(f"method {name!r}", params, method.parameters)
    if "output" in params:
        params = params | {"output": _checked_outputs(params["output"])}
    progress.check()
    return method.run(params, progress)


def _checked_outputs(given: object) -> list[str]:
    """Return the drawings to write, after checking that they can be written."""
    from gso.workshop import writers

    paths = [given] if isinstance(given, str) else given
    if not isinstance(paths, list) or not all(isinstance(path, str) for path in paths):
        raise OptionError(f"output is {given!r}; it must be a path, or a list of paths")
    for path in paths:
        writers.check_output(path)
    return paths


def _keywords(method: str, params: Json) -> Keywords:
    """Return those parameters that are keywords of the method's function."""
    return {k: params[k] for k in METHODS[method].keywords if k in params}


def _unfold(params: Json, progress: ProgressLines) -> Json:
    from gso.unfolding import unfold
    from gso.workshop import of_net

    given, keywords = GivenMesh.of(params), _keywords("unfold", params)
    net = unfold(given.surface, **keywords | {"cut": given.seams_and(params.get("cut"))})
    result: Json = {
        "usable": True,
        "reasons": [],
        "notes": list(net.notes),
        "metrics": {"parts": len(net), "folds": len(net.angles), "cut_length": net.cut_length},
        "flat": net_record(net, given.faces),
    }
    return result | _drawn(params, lambda name: of_net(name, net))


def _pieces(params: Json, progress: ProgressLines) -> Json:
    from gso.seams import pieces
    from gso.seams.piece_files import record, save

    given, keywords = GivenMesh.of(params), _keywords("pieces", params)
    seams = given.seams_and(params.get("keep"))
    found = pieces(
        given.mesh(),
        **keywords | {"keep": seams if len(seams) else None},
        callback=progress.say,
    )
    unit, folder = params.get("unit", "mm"), params.get("folder")
    known = record(found, unit)
    if folder is not None:
        known["files"] = [str(Path(folder, name)) for name in save(found, folder, unit)]
    return known | _flat(params, found.design, found.pattern, found.folded)


def _strips(params: Json, progress: ProgressLines) -> Json:
    from gso.result import record_of
    from gso.ruled.paneling.lay_strips import strips
    from gso.workshop.pattern_panels import of_result

    keywords = _keywords("strips", params) | _constraints(params)
    result = strips(GivenMesh.of(params).cut(), **keywords, callback=progress.step)
    known = record_of(result, params.get("unit", "mm")) | {"mesh": mesh_record(result.mesh)}
    if result.pattern is None:
        return known
    known["flat"] = pattern_record(result.pattern)
    return known | _drawn(params, lambda name: of_result(name, result, {}))


def _optimize(params: Json, progress: ProgressLines) -> Json:
    from gso import tasks
    from gso.hybrid import solve
    from gso.result import record_of

    keywords = _keywords("optimize", params) | _constraints(params)
    design = GivenMesh.of(params).cut()
    result = solve(design, **keywords, sparing=True, callback=progress.step)
    known = record_of(result, params.get("unit", "mm"))
    if not tasks.get(result.task).flat:
        return known | _flat(params, result.mesh, result.pattern, result.folded)
    return known | _flat(params, result.design, result.pattern, result.folded)


def _flatten(params: Json, progress: ProgressLines) -> Json:
    return _optimize(params | {"task": "flatten"}, progress)


def _fabricate(params: Json, progress: ProgressLines) -> Json:
    from gso.quantities import millimetres
    from gso.workshop.fabricate import fabricate

    given, keywords = GivenMesh.of(params), _keywords("fabricate", params)
    keywords |= {"finish": _finish(params.get("finish", {})), **_constraints(params)}
    if len(edges := given.seams_and(params.get("cut"))):
        keywords["cut"] = edges
    unit = millimetres(params.get("unit", "mm"))
    with TemporaryDirectory(prefix="gso-") as temporary:
        folder = params.get("folder")
        job = fabricate(given.surface, folder or temporary, **keywords, callback=progress.say)
        known = {
            "usable": job.usable,
            "reasons": [reason.record("mm") for reason in job.reasons],
            "notes": job.certificate["notes"],
            "certificate": plain(job.certificate),
            "parts": [part_record(part, unit) for part in job.parts],
        }
        if folder is not None:
            known["files"] = [str(job.folder / name) for name in job.files]
        return known


def _info(params: Json, progress: ProgressLines) -> Json:
    from gso.mesh_facts import facts, facts_record

    return facts_record(facts(GivenMesh.of(params).mesh()))


def _describe(params: Json, progress: ProgressLines) -> Json:
    from importlib.metadata import version

    methods = {name: list(method.parameters) for name, method in METHODS.items()}
    return {"gso": version("gso"), "protocol": PROTOCOL, "methods": methods}


def _constraints(params: Json) -> Keywords:
    """Return constraints as objects."""
    from gso.constraints import from_records

    if params.get("constraints") is None:
        return {}
    return {"constraints": from_records(params["constraints"])}


def _finish(given: object) -> Any:
    """Return how parts are finished; a thickness is a number or an object."""
    from gso.workshop import Finish, Thickness

    if not isinstance(given, dict):
        raise OptionError('finish is no object; give one such as {"thickness": 2, "kerf": 0.2}')
    check_keywords("finish", given, inspect.signature(Finish).parameters)
    thickness = given.get("thickness")
    if isinstance(thickness, dict):
        check_keywords("thickness", thickness, inspect.signature(Thickness).parameters)
        given = given | {"thickness": Thickness(**thickness)}
    elif thickness is not None:
        given = given | {"thickness": Thickness(thickness, given.get("k_factor", 0.5))}
    return Finish(**given)


def _flat(params: Json, surface: Mesh, pattern: Pattern | None, folded: Folded) -> Json:
    """Return a surface, its pattern and its parts."""
    from gso.workshop import of_surface

    known: Json = {"mesh": mesh_record(surface)}
    if pattern is None:
        return known
    known["flat"] = pattern_record(pattern)
    return known | _drawn(params, lambda name: of_surface(name, surface, pattern, {}, folded))


def _drawn(params: Json, made: Callable[[str], Made]) -> Json:
    """Return the parts of a flat surface, and write drawings of them where that is asked for."""
    from gso.quantities import millimetres
    from gso.workshop import Finish, drawn, writers
    from gso.workshop.names import spelled

    unit = millimetres(params.get("unit", "mm"))
    name = params.get("name") or _stem(params["mesh"])
    surface = made(spelled(name))
    drawing, _ = drawn([surface], unit, Finish(notches=None))
    paths = params.get("output", [])
    for path in paths:
        writers.write(drawing, path)
    # In the order of their numbers, which the pattern has too.
    placed = {part.name: part for part in drawing.parts}
    known: Json = {"parts": [part_record(placed[p.name], unit) for p in surface.panels]}
    return known | ({"files": paths} if paths else {})


def _stem(mesh: object) -> str:
    return Path(mesh).stem if isinstance(mesh, str) else "part"


METHODS = {
    "unfold": Method(_unfold, (*_MESH, *_DRAWN), "gso.unfolding.unfold_mesh:unfold"),
    "pieces": Method(_pieces, (*_MESH, *_DRAWN, "folder"), "gso.seams.search:pieces"),
    "strips": Method(_strips, (*_MESH, *_DRAWN), "gso.ruled.paneling.lay_strips:strips"),
    "flatten": Method(
        _flatten, (*_MESH, *_DRAWN), "gso.tno.optimize:optimize", _OBJECTS | {"task"}
    ),
    "optimize": Method(_optimize, (*_MESH, *_DRAWN), "gso.tno.optimize:optimize"),
    "fabricate": Method(_fabricate, (*_MESH, "folder"), "gso.workshop.fabricate:fabricate"),
    "info": Method(_info, _MESH),
    "describe": Method(_describe, ()),
}
