"""Forces and turns where yarns cross, by the kind of the crossing."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from knittest.kernels.contact import FIRST_ALONG, POINT, SECOND_ALONG, spline_weights
from knittest.models.yarn_model import YarnModel

Array = NDArray[np.float64]
Index = NDArray[np.int64]


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


def crossings(model: YarnModel, among: NDArray[np.bool_] | None = None) -> dict[str, Crossings]:
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
    angle = np.rad2deg(_angles(model, touching))
    kind, names = _kinds(model, touching)
    found = {}
    for number, name in enumerate(names):
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


def _kinds(model: YarnModel, touching: Index) -> tuple[Index, list[str]]:
    """Number of the kind of each contact, and names of the kinds."""
    names = model.mesh.part_names
    part = parts_of_nodes(model)[model.tracker.contacts.piece[:, touching]]
    low, high = part.min(axis=0), part.max(axis=0)
    return low * len(names) + high, [f"{a}-{b}" for a in names for b in names]


def parts_of_nodes(model: YarnModel) -> Index:
    """Part of the yarn of every node, (n_nodes,)."""
    of_chain = np.zeros(int(model.group.chain.max()) + 1, np.int64)
    of_chain[model.mesh.yarn] = model.mesh.part
    found: Index = of_chain[model.group.chain[model.masters()]]
    return found


def _angles(model: YarnModel, touching: Index) -> Array:
    """Angles [rad] between the yarns of the contacts ``touching``."""
    first, second = (_tangent(model, side, touching) for side in (0, 1))
    along = np.abs(np.sum(first * second, axis=0))
    return np.arctan2(np.linalg.norm(np.cross(first, second, axis=0), axis=0), along)


def _tangent(model: YarnModel, side: int, touching: Index) -> Array:
    """Tangents (3, n) of the yarns on one side of contacts, not of length 1."""
    i, s = model.tracker.contacts.piece[side, touching], model.tracker.contacts.parameter[side, touching]
    x = model.nodes.position
    before, after = x[:, i] - x[:, i - 1], x[:, i + 1] - x[:, i]
    found: Array = (1.0 - s) * before + s * after
    return found


def surfaces(model: YarnModel, nodes: Index) -> tuple[float, float]:
    """Lowest and highest yarn surface [mm] at the ends and middles of the pieces of ``nodes``."""
    z, radius = model.nodes.position[2], half_heights(model)[nodes]
    heights = [w[0] * z[nodes - 1] + w[1] * z[nodes] + w[2] * z[nodes + 1] for w in map(_weights, (0.0, 0.5, 1.0))]
    return float(np.min(heights - radius)), float(np.max(heights + radius))


def half_heights(model: YarnModel) -> Array:
    """Half extents [mm] of the sections of all nodes along z, as ellipses lie now."""
    contacts, radius = model.tracker.contacts, model.group.radius
    if not contacts.excess.size:
        return radius
    found: Array = np.sqrt(contacts.square + contacts.excess * contacts.turned[2] ** 2)
    return found


def _weights(parameter: float) -> tuple[float, float, float]:
    before, at, after = spline_weights.py_func(parameter)
    return before, at, after
