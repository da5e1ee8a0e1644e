"""Rigid alignment of plane images to their constraints, before the solve deforms them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gso import geometry
from gso.components import labels
from gso.constraints import Compiled, Part, Relations
from gso.constraints.linear import reduce
from gso.mesh import Mesh
from gso.parametrization.embedding import parts
from gso.parametrization.packing import beside, upright
from gso.typing import Array, Ints

#: Number of initial rotations, as alignment to a curve has several local minima, and of steps.
_TURNS, _STEPS = 8, 60


def align(mesh: Mesh, flat: Array, constraints: Compiled) -> Array:
    """Move an image (n, 2) rigidly, component by component, closest to its constraints.

    Iterated closest points (Besl and McKay 1992) on the vertices with a target position, line
    or mirror image. With handles alone one step gives the best rigid motion.
    """
    wanted = (*constraints.anchored, *_seams(mesh, constraints))
    if not wanted:
        return flat
    held = replace(constraints, parts=wanted)
    out: Array = flat.copy()
    pieces = parts(mesh)
    # In a second round pieces align to those that they are glued to.
    for ids in pieces if len(pieces) == 1 else 2 * pieces:
        tries = [_closer(_turn(flat[ids], k), ids, out, held) for k in range(_TURNS)]
        out[ids] = min(tries, key=lambda t: t[0])[1]
    return out


def _seams(mesh: Mesh, constraints: Compiled) -> list[Part]:
    """Return the glue constraints between different components of a mesh."""
    out: list[Part] = []
    for p in constraints.parts:
        if isinstance(p, Relations) and p.is_glue:
            apart = mesh.components[p.first] != mesh.components[p.second]
            if apart.any():
                out.append(replace(p, first=p.first[apart], second=p.second[apart]))
    return out


def settle(mesh: Mesh, flat: Array, constraints: Compiled) -> Array:
    """Keep the anchored components where they are, and place the others beside them.

    Components that constraints tie to each other move together.
    """
    label = labels(mesh, constraints.links)
    groups = [np.flatnonzero(label == k) for k in range(label.max() + 1)]
    fixed = np.zeros(len(flat), bool)
    for part in constraints.anchored:
        fixed[part.vertices] = True
    loose = [ids for ids in groups if not fixed[ids].any()]
    tight = [ids for ids in groups if fixed[ids].any()]
    out: Array = flat.copy()
    images = beside([upright(flat[ids]) for ids in loose])
    if tight and loose:
        there = flat[np.concatenate(tight)]
        gap = 0.05 * float(np.ptp(there[:, 0]))
        corner = np.array([there[:, 0].max() + gap, there[:, 1].min()])
        images = [p + corner for p in images]
    for ids, image in zip(loose, images, strict=True):
        out[ids] = image
    return out


def _turn(flat: Array, k: int) -> Array:
    angle = 2.0 * np.pi * k / _TURNS
    c, s = np.cos(angle), np.sin(angle)
    return np.asarray(flat @ np.array([[c, s], [-s, c]]))


def _closer(image: Array, ids: Ints, flat: Array, held: Compiled) -> tuple[float, Array]:
    """Fit one component to its targets by rigid motions; return the residual and the image."""
    whole = flat.copy()
    left = np.inf
    for _ in range(_STEPS):
        whole[ids] = image
        here, there = _targets(whole, held)
        inside = np.isin(here, ids)
        p, q = whole[here[inside]], there[inside]
        if not len(p):
            return 0.0, image
        before, left = left, float(((p - q) ** 2).sum())
        if left >= (1.0 - 1e-6) * before:
            break
        image = _moved(image, p, q)
    return left, image


def _moved(image: Array, p: Array, q: Array) -> Array:
    """Apply to an image the rigid motion that brings points p closest to q."""
    turn, shift = geometry.closest_motion(p, q)
    return np.asarray(image @ turn.T + shift)


def _targets(flat: Array, held: Compiled) -> tuple[Ints, Array]:
    """Return the constrained vertices (k,) and the nearest target of each (k, 2)."""
    ids, there = [], []
    reduction = reduce(held.parts)
    if reduction is not None:
        projection, _, offset = reduction.maps(0, flat.size)
        ids.append(reduction.ids)
        there.append((offset + projection @ flat.ravel()).reshape(-1, 2)[reduction.ids])
    for part in held.parts:
        found = part.targets(flat)
        if found is not None:
            ids.append(found[0])
            there.append(found[1])
    if not ids:
        return np.zeros(0, np.int64), np.zeros((0, 2))
    return np.concatenate(ids), np.concatenate(there)
