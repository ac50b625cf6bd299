"""Crossings of yarns: forces and turns by the kind of the crossing, loop wrap ratio, initial equilibrium of the
yarns.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from knittest.base.arrays import Array, Flags, Index
from knittest.base.history import InitialEquilibrium
from knittest.kernels.contact import FIRST_ALONG, POINT, SECOND_ALONG, spline_weights
from knittest.kernels.monitor import axial_state
from knittest.models.explicit_model import ExplicitModel
from knittest.models.yarn_model import YarnModel


@dataclass(frozen=True)
class Crossings:
    """Crossings of one kind that touch: how many, their mean and largest normal force [N], the mean share of it that
    friction has [-], and the mean angle [deg] between the yarns, from 0 (side by side) to 90.

    Contacts in a row along a yarn that bends round another are one crossing.
    """

    count: float
    normal_force: float
    largest_force: float
    friction_ratio: float
    angle: float


def crossings(model: YarnModel, among: Flags | None = None) -> dict[str, Crossings]:
    """Crossings of ``model`` that touch, by the names of both parts, such as ``warp-weft``; each by its share.

    Of the nodes ``among`` (n_nodes,) a contact has one at least; without them all count.
    """
    contacts, count = model.tracker.contacts, model.tracker.count
    share = contacts.share[:count]
    counts = (contacts.force[:, :count] != 0.0).any(axis=0) & (share > 0.0)
    if among is not None:
        counts &= among[contacts.piece[:, :count]].any(axis=0)
    touching = np.flatnonzero(counts)
    row = _rows(model, touching)
    in_row = np.bincount(row, minlength=touching.size)[row]
    force, offset = contacts.force[:, touching], contacts.offset[:, touching]
    normal = np.sum(force * offset, axis=0) / np.linalg.norm(offset, axis=0)
    friction = np.sqrt(np.maximum(np.sum(force**2, axis=0) - normal**2, 0.0))
    first, second = (_curve(model, side, touching).along for side in (0, 1))
    along = np.abs(np.sum(first * second, axis=0))
    angle = np.rad2deg(np.arctan2(np.linalg.norm(np.cross(first, second, axis=0), axis=0), along))
    names, part = model.mesh.part_names, parts_of_nodes(model)[contacts.piece[:, touching]]
    kind = part.min(axis=0) * len(names) + part.max(axis=0)
    found = {}
    for number, name in enumerate(f"{a}-{b}" for a in names for b in names):
        of = kind == number
        if of.any():
            weight = share[touching[of]]
            pressed, every = float(weight @ normal[of]), weight / in_row[of]
            number_of = float(every.sum())
            found[name] = Crossings(
                number_of, pressed / number_of, float(np.bincount(row[of], normal[of]).max()),
                float(weight @ friction[of]) / pressed if pressed > 0.0 else 0.0, float(every @ angle[of]) / number_of,
            )  # fmt: skip
    return found


def _rows(model: YarnModel, touching: Index) -> Index:
    """Number of the crossing of each contact: one of its own, or that of the piece before along another yarn."""
    contacts, chain = model.tracker.contacts, model.group.chain
    line, piece = contacts.line[touching], contacts.piece[:, touching]
    second = (line == SECOND_ALONG).astype(np.int64)
    every = np.arange(touching.size)
    held, other = piece[second, every], chain[piece[1 - second, every]]
    order = np.lexsort((held, other, line))
    begins = (np.diff(held[order], prepend=-1) != 1) | (np.diff(other[order], prepend=-1) != 0)
    begins |= (line[order] < FIRST_ALONG) | (np.diff(line[order], prepend=POINT) != 0.0)
    row = np.empty(touching.size, np.int64)
    row[order] = np.cumsum(begins) - 1
    return row


def parts_of_nodes(model: YarnModel) -> Index:
    """Part of the yarn of every node, (n_nodes,)."""
    of_chain = np.zeros(int(model.group.chain.max()) + 1, np.int64)
    of_chain[model.mesh.yarn] = model.mesh.part
    return of_chain[model.group.chain[model.masters()]]


def surfaces(model: YarnModel, nodes: Index) -> tuple[float, float]:
    """Lowest and highest yarn surface [mm] at the ends and middles of the pieces of ``nodes``."""
    z, radius = model.nodes.position[2], half_heights(model)[nodes]
    weights = map(spline_weights.py_func, (0.0, 0.5, 1.0))
    heights = [w[0] * z[nodes - 1] + w[1] * z[nodes] + w[2] * z[nodes + 1] for w in weights]
    return float(np.min(heights - radius)), float(np.max(heights + radius))


def half_heights(model: YarnModel) -> Array:
    """Half extents [mm] of the sections of all nodes along z, as ellipses lie now."""
    contacts, radius = model.tracker.contacts, model.group.radius
    if model.soft_contact is not None:
        return np.full_like(radius, 0.5 * model.soft_contact.law.outer)
    if not contacts.excess.size:
        return radius
    return np.sqrt(contacts.square + contacts.excess * contacts.turned[2] ** 2)


# Wrap of yarns round each other where they cross: how far their centre-lines are from having more than one closest
# point there.

#: cosine of the angle between yarns from which on they lie side by side: legs that touch along a length wrap nothing
PARALLEL_COSINE = 0.9


class Curve(NamedTuple):
    """Curves at one parameter each: ``place`` [mm], first derivative ``along`` and second ``bend``, (3, n) each."""

    place: Array
    along: Array
    bend: Array


def cosine(first: Curve, second: Curve) -> Array:
    """Cosine (n,) of the angle between two curves, without its sign."""
    size = np.linalg.norm(first.along, axis=0) * np.linalg.norm(second.along, axis=0)
    return np.abs(np.sum(first.along * second.along, axis=0)) / size


def wrap_ratio(first: Curve, second: Curve) -> Array:
    """Determinant (n,) [-] of the second derivatives of half the squared distance of two curves, over both tangents
    squared, at their closest points: with w from the second to the first, tangents u, v and second derivatives a, b

    (1 + w.a / u^2) (1 - w.b / v^2) - (u.v)^2 / (u^2 v^2)

    Straight lines give the square of the sine of their angle, arcs of radii R, r in planes at right angles that wrap
    each other d apart (1 - d/R) (1 - d/r). At 0 the closest points split, as those of an arc about its own axis.
    """
    offset = first.place - second.place
    bent = 1.0 + np.sum(offset * first.bend, axis=0) / np.sum(first.along**2, axis=0)
    other = 1.0 - np.sum(offset * second.bend, axis=0) / np.sum(second.along**2, axis=0)
    return bent * other - cosine(first, second) ** 2


def least_wrap_ratio(model: YarnModel, part: str, among: Flags) -> float:
    """Least :func:`wrap_ratio` of yarns of one ``part`` where they cross each other; nan where none do.

    They touch, or nearly touch (by the skin of the search).

    Of the nodes ``among`` (n_nodes,) a crossing has one at least.
    """
    names, contacts, count = model.mesh.part_names, model.tracker.contacts, model.tracker.count
    if part not in names:
        return float("nan")
    piece = contacts.piece[:, :count]
    alike = (parts_of_nodes(model)[piece] == names.index(part)).all(axis=0)
    these = np.flatnonzero(alike & among[piece].any(axis=0) & (contacts.share[:count] > 0.0))
    first, second = (_curve(model, side, these) for side in (0, 1))
    found = wrap_ratio(first, second)[cosine(first, second) < PARALLEL_COSINE]
    return float(found.min()) if found.size else float("nan")


def _curve(model: YarnModel, side: int, these: Index) -> Curve:
    """Centre-lines on one side of the contacts ``these``."""
    i, s = model.tracker.contacts.piece[side, these], model.tracker.contacts.parameter[side, these]
    before, at, after = (model.nodes.position[:, i + k] for k in (-1, 0, 1))
    weights = spline_weights.py_func(s)
    place = weights[0] * before + weights[1] * at + weights[2] * after
    return Curve(place, (1.0 - s) * (at - before) + s * (after - at), before - 2.0 * at + after)


#: part of the loops
LOOPS = "knit"


def initial_equilibrium(model: ExplicitModel, residual: float = np.nan) -> InitialEquilibrium | None:
    """State of ``model`` with its force ``residual`` [-], where it is ``typical``; None of shells.

    The edge of a specimen, where loops that nothing holds have shed their tension, does not count.
    """
    if not isinstance(model, YarnModel):
        return None
    typical = model.representative_nodes()
    pieces = np.flatnonzero(typical & model.group.is_piece)
    low, high = surfaces(model, pieces) if pieces.size else (np.nan, np.nan)
    force = axial_state(model.nodes, model.parts, model.beams)[1][model.element_node]
    names = model.mesh.part_names
    loops = typical[model.element_node] & (model.mesh.part == (names.index(LOOPS) if LOOPS in names else -1))
    tension = float(force[loops].mean()) if loops.any() else 0.0
    pressed = {kind: of.normal_force for kind, of in crossings(model, typical).items()}
    return InitialEquilibrium(tension, high - low, residual, pressed, least_wrap_ratio(model, LOOPS, typical))
