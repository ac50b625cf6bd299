"""Contacts of elliptic sections at yarns that bend as the ellipse does: there one nearest place becomes two.

Yarns that are pressed piece by piece touch in both; what is left are those that bend along the section of such a yarn.
"""

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import InputError
from knittest.kernels.contact import BESIDE, FIRST_ALONG, SECOND_ALONG
from knittest.kernels.state import Contacts
from knittest.models.contact_tracker import ContactTracker

Array = NDArray[np.float64]

#: curvature of a yarn times the distance to the centre of the ellipse's curvature, at which the nearest place turns
#: into two, beside it
CONFORMS = 1.0
#: the same of the sections that are advised
ADVISED = 0.8
#: kind of contact that holds the first yarn, and the second
HOLDS = (FIRST_ALONG, SECOND_ALONG)
#: share of the sum of contact forces that such contacts may carry
MOST = 0.05


def conformity(tracker: ContactTracker, position: Array) -> Array:
    """Curvature of the yarns times their distance [-] of the tracked contacts, (count,): the larger of both yarns, of
    those whose place on them is free.

    ``position`` (3, n_nodes) [mm]. The distance is that to the circle that osculates the section of the other.
    """
    contacts, n = tracker.contacts, tracker.count
    found = np.zeros((2, n))
    for side, sign in ((0, -1.0), (1, 1.0)):
        i, s = contacts.piece[side, :n], contacts.parameter[side, :n]
        bend = position[:, i - 1] - 2.0 * position[:, i] + position[:, i + 1]
        tangent = position[:, i] - position[:, i - 1] + s * bend
        along = sign * np.sum(_to_curvature(contacts, side, n) * bend, axis=0) / np.sum(tangent * tangent, axis=0)
        found[side] = np.where(contacts.line[:n] != HOLDS[side], along, 0.0)
    largest: Array = found.max(axis=0)
    return largest


def _to_curvature(contacts: Contacts, side: int, n: int) -> Array:
    """Offset (3, n) [mm] of the centre-line on one ``side`` and the centre of curvature of the other's section."""
    offset: Array = contacts.offset[:, :n]
    return offset + (contacts.shift if side == 0 else contacts.other)[:, :n] if contacts.touch.size else offset


def refuse_conforming(tracker: ContactTracker, position: Array) -> None:
    """Raise :class:`InputError` for the reason that :func:`conforming` gives."""
    if reason := conforming(tracker, position):
        raise InputError(reason)


def conforming(tracker: ContactTracker, position: Array) -> str:
    """Say which sections lie along yarns that bend around them, with the ratio that would do; empty if none does."""
    contacts, n = tracker.contacts, tracker.count
    if not contacts.touch.size or not n:
        return ""
    force = np.linalg.norm(contacts.force[:, :n], axis=0)
    elliptic = (contacts.touch[:n] > 0.0) & (contacts.line[:n] != BESIDE)
    along = np.where(elliptic & (force > 0.0), conformity(tracker, position), 0.0)
    if force[along > CONFORMS].sum() <= MOST * force.sum():
        return ""
    worst = int(np.argmax(np.where(along > CONFORMS, force, 0.0)))
    first, second = (int(i) for i in contacts.piece[:, worst])
    ratio, most = _ratio_that_does(contacts, worst, first, second, float(along[worst]))
    less = f"at most about {most:.2f}" if most >= 1.0 else "1, and a packing higher"
    return (
        f"fabric.reinforcing.section.width_to_height: {tracker.name_of(first)} and {tracker.name_of(second)} bend "
        f"along each other's section of {ratio:.3g} times its height and would touch in two places, which contacts do "
        f"not follow; expected {less}"
    )


def _ratio_that_does(contacts: Contacts, c: int, first: int, second: int, along: float) -> tuple[float, float]:
    """Width over height [-] of the flatter section of contact ``c``, and the one that conforms by less.

    Lying flat an ellipse has the radius of curvature sqrt(area / pi) ratio^(3/2).
    """
    touch, arm = float(contacts.touch[c]), float(contacts.arm[c])
    flat = [float(contacts.square[i] / (contacts.square[i] + contacts.excess[i])) ** 0.5 for i in (first, second)]
    side = int(flat[1] > flat[0])
    radius = touch * (arm if side == 0 else 1.0 - arm)
    away = float(np.linalg.norm(_to_curvature(contacts, 1 - side, c + 1)[:, c]))
    less = radius - away * (1.0 - ADVISED / along)
    return flat[side], flat[side] * (max(less, 0.0) / radius) ** (2.0 / 3.0)
