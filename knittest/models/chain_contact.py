"""The contact group of chains: their pieces, sections and law."""

from math import sqrt

import numpy as np
from numpy.typing import NDArray

from knittest.kernels.flatten import TINY
from knittest.kernels.state import ContactLaw
from knittest.models.chain_layout import Layout
from knittest.models.contact_tracker import YarnContactGroup
from knittest.models.flattening import shapes_at_rest
from knittest.models.yarn_contact import YarnContact

Array = NDArray[np.float64]
Index = NDArray[np.int64]

#: pieces of one yarn closer along it than 1.2 times half a bend plus this margin [mm] never touch
BEND_MARGIN = 0.2


def contact_group(
    lay: Layout,
    mass: Array,
    node_cut: Index,
    contact: YarnContact | None,
    torsional: float,
    part: Index,
    normal: Array,
) -> YarnContactGroup:
    """Pieces of the chains that may touch, with ``part`` of each node and the ``normal`` (n_nodes, 3) of its element.

    ``torsional`` [N mm/rad] is the resistance of crossings to spin; without ``contact`` nothing acts.
    """
    radius, wide = lay.of_card("radius"), lay.of_card("wide")
    before = np.concatenate([[False], lay.joined[:-1]])
    is_piece = lay.joined & before
    half_piece = np.zeros(len(radius))
    half_piece[1:] = 0.5 * np.maximum(lay.length[1:], lay.length[:-1])
    mean = np.array([lay.mean_length(s) for s in range(len(lay.cards))])
    bend = 1.2 * (0.5 * np.pi * 2.0 * wide + BEND_MARGIN)
    law = ContactLaw(0.0, 0.0, 0.0, 0.0, 0.0)
    if contact is not None and is_piece.any():
        damping = 2.0 * contact.damping * sqrt(contact.normal * 0.5 * float(mass[is_piece].min()))
        law = contact.law(float(radius.min()), damping, torsional)
    n_parts, patch = int(part.max()) + 1, None if contact is None else contact.patch
    levers = np.zeros((2, n_parts, n_parts)) if patch is None else patch.levers(n_parts)
    return YarnContactGroup(
        radius, half_piece, np.ceil(bend / mean[lay.section]).astype(np.int64), is_piece, lay.chain,
        lay.near_ends(0 if contact is None else contact.cut), node_cut, law, part, levers, wide, *_heights(lay, normal),
        _shapes(lay, contact), pressed=contact is not None and contact.pressed,
    )  # fmt: skip


def _heights(lay: Layout, normal: Array) -> tuple[Array, Array, Array, Array]:
    """Heights (3, n) of the sections at the nodes before they turn and now, squares of the half width and what that of
    the half height is more (n,) [mm^2]; empty if all sections are round.
    """
    radius, wide = lay.of_card("radius"), lay.of_card("wide")
    if (wide == radius).all() and not lay.of_card("squeezable").any():
        return np.zeros((3, 0)), np.zeros((3, 0)), np.zeros(0), np.zeros(0)
    of_elements = np.where(lay.joined[:, None], normal, 0.0)
    height = of_elements + np.roll(of_elements, 1, axis=0)
    height /= np.maximum(np.linalg.norm(height, axis=1, keepdims=True), 1e-12)
    excess = radius**2 - wide**2
    excess[(excess == 0.0) & (lay.of_card("squeezable") > 0.0)] = -TINY
    return height.T.copy(), height.T.copy(), wide**2, excess


def _shapes(lay: Layout, contact: YarnContact | None) -> Array:
    half = np.where(lay.joined, 0.5 * lay.rest, 0.0)
    length = half + np.concatenate([[0.0], half[:-1]])
    high, wide, stiff, exponent = (lay.of_card(name) for name in ("radius", "wide", "squeezable", "exponent"))
    stiffest = 0.0 if contact is None else contact.stiffest(float(high.min()))
    return shapes_at_rest(high, wide, stiff, exponent, length, stiffest)
