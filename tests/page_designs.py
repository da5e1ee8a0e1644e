"""Designs for pages, of any number of panels, without a solve."""

from __future__ import annotations

import numpy as np

import gso
from gso.mesh import Mesh
from gso.workshop import (
    Finish,
    Shown,
    Views,
    design_record,
    fitted,
    of_surface,
    page_html,
    parts_from,
)


def vault(rows: int, columns: int, fine: int = 4, name: str = "vault"):
    """A barrel vault of rows x columns panels of fine x fine quads each, in metres."""
    turn = np.linspace(0.0, np.pi / 2, rows * fine + 1)
    y = np.linspace(0.0, 3.0, columns * fine + 1)
    t, y = np.meshgrid(turn, y, indexing="ij")
    mesh = Mesh.from_grid(np.stack([2.0 * np.sin(t), y, 2.0 * np.cos(t)], axis=-1))
    flat = np.stack([2.0 * t, y], axis=-1).reshape(-1, 2)
    row, column = np.divmod(np.arange(len(mesh.faces)), columns * fine)
    panel = row // fine * columns + column // fine
    he = mesh.half_edges
    inner = he.interior
    apart = inner[panel[he.face[inner]] != panel[he.face[he.twin[inner]]]]
    opened = gso.cut(mesh, np.stack([he.origin[apart], he.dest[apart]], axis=1)).opened
    owner = np.zeros(len(opened.vertex), int)
    owner[opened.mesh.faces] = panel[:, None]
    places = flat[opened.vertex] + 0.5 * np.stack(np.divmod(owner, columns), axis=1)
    pattern = gso.Pattern(places, opened.mesh.faces, opened.vertex, opened.seams)
    return mesh, of_surface(name, mesh, pattern, {"deviation_max": 0.0})


def job_of(mesh: Mesh, made, copies: tuple[Mesh, ...] = ()):
    """What the page of a design is made of: certificate, parts and views."""
    finish = Finish()
    fit = fitted(made, 1000.0, finish)
    parts, _ = parts_from(fit, finish)
    record = design_record(fit, parts, [made.name]) | {"reasons": []}
    for entry in record["parts"]:
        entry["same_as"] = None
    certificate = {"usable": True, "reasons": [], "notes": [], "designs": [record], "sheets": []}
    shown = [Shown(made, mesh, 1000.0, fit.panels, copies)]
    return certificate, parts, Views(shown, certificate)


def html_of(*given) -> str:
    certificate, parts, views = job_of(*given)
    return page_html(certificate, parts, [], views)
