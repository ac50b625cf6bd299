"""Wrap of yarns round each other where they cross: how far their centre-lines are from having more than one closest
point there.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from knittest.kernels.contact import spline_weights
from knittest.models.crossings import parts_of_nodes
from knittest.models.yarn_model import YarnModel

Array = NDArray[np.float64]
Index = NDArray[np.int64]

#: cosine of the angle between yarns from which on they lie side by side: legs that touch along a length wrap nothing
BESIDE = 0.9


class Curve(NamedTuple):
    """Curves at one parameter each: ``place`` [mm], first derivative ``along`` and second ``bend``, (3, n) each."""

    place: Array
    along: Array
    bend: Array


def cosine(first: Curve, second: Curve) -> Array:
    """Cosine (n,) of the angle between two curves, without its sign."""
    size = np.linalg.norm(first.along, axis=0) * np.linalg.norm(second.along, axis=0)
    found: Array = np.abs(np.sum(first.along * second.along, axis=0)) / size
    return found


def wrap(first: Curve, second: Curve) -> Array:
    """Determinant (n,) [-] of the second derivatives of half the squared distance of two curves, over both tangents
    squared, at their closest points: with w from the second to the first, tangents u, v and second derivatives a, b

    (1 + w.a / u^2) (1 - w.b / v^2) - (u.v)^2 / (u^2 v^2)

    Straight lines give the square of the sine of their angle, arcs of radii R, r in planes at right angles that wrap
    each other d apart (1 - d/R) (1 - d/r). At 0 the closest points split, as those of an arc about its own axis.
    """
    offset = first.place - second.place
    bent = 1.0 + np.sum(offset * first.bend, axis=0) / np.sum(first.along**2, axis=0)
    other = 1.0 - np.sum(offset * second.bend, axis=0) / np.sum(second.along**2, axis=0)
    found: Array = bent * other - cosine(first, second) ** 2
    return found


def least_wrap(model: YarnModel, part: str, among: NDArray[np.bool_]) -> float:
    """Least :func:`wrap` of yarns of one ``part`` where they cross each other, touching or about to (by the skin of the
    search); nan where none do.

    Of the nodes ``among`` (n_nodes,) a crossing has one at least.
    """
    names, contacts, count = model.mesh.part_names, model.tracker.contacts, model.tracker.count
    if part not in names:
        return float("nan")
    piece = contacts.piece[:, :count]
    alike = (parts_of_nodes(model)[piece] == names.index(part)).all(axis=0)
    these = np.flatnonzero(alike & among[piece].any(axis=0) & (contacts.share[:count] > 0.0))
    first, second = (_curve(model, side, these) for side in (0, 1))
    found = wrap(first, second)[cosine(first, second) < BESIDE]
    return float(found.min()) if found.size else float("nan")


def _curve(model: YarnModel, side: int, these: Index) -> Curve:
    """Centre-lines on one side of the contacts ``these``."""
    i, s = model.tracker.contacts.piece[side, these], model.tracker.contacts.parameter[side, these]
    before, at, after = (model.nodes.position[:, i + k] for k in (-1, 0, 1))
    weights = spline_weights.py_func(s)
    place = weights[0] * before + weights[1] * at + weights[2] * after
    return Curve(place, (1.0 - s) * (at - before) + s * (after - at), before - 2.0 * at + after)
