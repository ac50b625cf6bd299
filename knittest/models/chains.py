"""Yarns as chains of beams: their arrays, lumped masses, critical step and contact group."""

from collections.abc import Sequence
from dataclasses import InitVar, dataclass, field
from math import sqrt

import numpy as np

from knittest.base.arrays import Array, Flags, Index
from knittest.base.errors import InputError
from knittest.base.history import Mesh
from knittest.base.units import round_down
from knittest.config.aliases import warn_of_old_name
from knittest.kernels.beam import rotary_inertia_factor, wave_speed
from knittest.kernels.flattening import TINY
from knittest.kernels.laws import hinge_tables
from knittest.kernels.state import Beams, ContactLaw
from knittest.materials.yarn_section import Section
from knittest.models.contact_tracker import YarnContactGroup
from knittest.models.explicit_model import make_nodes, make_partitions
from knittest.models.inputs import chain_normals
from knittest.models.natural_state import natural_normal, natural_state, shapes_at_rest
from knittest.models.yarn_contact import YarnContact
from knittest.models.yarn_model import YarnModel


@dataclass(frozen=True)
class Chain:
    """One yarn as a chain of beams.

    ``points`` (n, 3) [mm] are its shape at the start and the control points of its centre-line; ``part`` numbers the
    part of the model. ``fail_strain`` and ``slack`` [-] of its elements are (n - 1,) or one for all. ``stretch`` [-] is
    the true length over that of the polygon, for its mass. ``degree_of_set`` [-], (n - 1,) or one for all, is the share
    of the curvature that is free of moment; the rest was bent in. ``normal`` of a flat section, (3,) for all elements
    or (n - 1, 3), is the direction at the start about which it bends with ``Section.across``, and along which an
    elliptic one is as high as ``Section.radius`` says; its component along the chain is ignored.
    ``loop_shortening`` [-], (n - 1,) or one for all, is the share by which the yarn is shorter at rest than its
    ``points``: it starts under tension.
    """

    points: Array
    section: Section
    part: int = 0
    fail_strain: Array | float = np.inf
    slack: Array | float = 0.0
    stretch: float = 1.0
    degree_of_set: Array | float = 1.0
    normal: Array | None = None
    loop_shortening: Array | float = 0.0
    draw_in: InitVar[Array | float | None] = field(default=None, kw_only=True)  # old name, read for one more version

    def __post_init__(self, draw_in: Array | float | None) -> None:
        if draw_in is not None:
            warn_of_old_name("Chain", "draw_in", "loop_shortening")
            object.__setattr__(self, "loop_shortening", draw_in)


class Layout:
    """Arrays over the nodes of all chains, (n_nodes,): chain, section, length of the element behind (1 at ends).

    ``cards`` are the sections, ``number`` (n_chains,) that of each chain; ``rest`` are the lengths without tension.
    """

    def __init__(self, chains: Sequence[Chain], cards: list[Section], number: Index) -> None:
        self.chains, self.cards, self.number = chains, cards, number
        count = np.array([len(c.points) for c in self.chains])
        self.start = np.concatenate([[0], np.cumsum(count)]).astype(np.int64)
        self.chain = np.repeat(np.arange(len(self.chains)), count).astype(np.int64)
        self.section = self.number[self.chain]
        self.position = np.concatenate([np.asarray(c.points, float) for c in self.chains])
        self.chord = np.diff(self.position, axis=0, append=self.position[-1:] + 1.0)
        self.joined = np.append(self.chain[1:] == self.chain[:-1], False)
        self.length = np.where(self.joined, np.linalg.norm(self.chord, axis=1), 1.0)
        self.rest = self.length * (1.0 - np.where(self.joined, self.element_field("loop_shortening"), 0.0))

    def inner_node_flags(self) -> Flags:
        """Nodes that are not the end of a chain."""
        inner = np.full(len(self.chain), True)
        inner[self.start[:-1]] = inner[self.start[1:] - 1] = False
        return inner

    def chain_end_flags(self, count: int) -> Flags:
        """Pieces among the ``count`` first or last of their chain."""
        place, stop = np.arange(len(self.chain)), self.start[1:][self.chain] - 1
        return (place - self.start[:-1][self.chain] <= count) | (stop - place <= count) if count else place < 0

    def section_constant(self, name: str) -> Array:
        """A constant of each node's section."""
        return np.array([getattr(c, name) for c in self.cards])[self.section]

    def element_field(self, name: str) -> Array:
        """A field of the chains that may be one number or one an element, on all nodes."""
        given = ((np.asarray(getattr(c, name), float), len(c.points) - 1) for c in self.chains)
        return np.concatenate([np.append(np.broadcast_to(values, count), np.inf) for values, count in given])

    def normals(self) -> Array:
        """Normals of the chains' elements (n, 3), not yet across them; nan where a round section has none."""
        rows = []
        for number, chain in enumerate(self.chains):
            rows.append(np.full((len(chain.points), 3), np.nan))
            if chain.section.across is not None or chain.section.half_width is not None:
                rows[-1][:-1] = chain_normals(chain.points, chain.normal, number)
        return np.concatenate(rows)

    def mean_length(self, card: int) -> float:
        """Mean element length of a section [mm]."""
        of = (self.section == card) & self.joined
        return float(self.length[of].mean()) if of.any() else 1.0


#: pieces of one yarn closer along it than 1.2 times half a bend plus this margin [mm] never touch
BEND_MARGIN = 0.2


def contact_group(
    lay: Layout, mass: Array, node_cut: Index, contact: YarnContact | None, torsional: float, part: Index, normal: Array
) -> YarnContactGroup:
    """Pieces of the chains that may touch, with ``part`` of each node and the ``normal`` (n_nodes, 3) of its element.

    ``torsional`` [N mm/rad] is the resistance of crossings to spin; without ``contact`` nothing acts.
    """
    radius, wide = lay.section_constant("radius"), lay.section_constant("wide")
    before = np.concatenate([[False], lay.joined[:-1]])
    is_piece = lay.joined & before
    half_piece = np.zeros(len(radius))
    half_piece[1:] = 0.5 * np.maximum(lay.length[1:], lay.length[:-1])
    mean = np.array([lay.mean_length(s) for s in range(len(lay.cards))])
    bend = 1.2 * (0.5 * np.pi * 2.0 * wide + BEND_MARGIN)
    if contact is not None and contact.shell is not None:
        bend[:] = contact.shell.along
    law = ContactLaw(0.0, 0.0, 0.0, 0.0, 0.0)
    if contact is not None and is_piece.any():
        damping = 2.0 * contact.damping * sqrt(contact.normal * 0.5 * float(mass[is_piece].min()))
        law = contact.law(float(radius.min()), damping, torsional)
    n_parts, patch = int(part.max()) + 1, None if contact is None else contact.patch
    soft_law, half = None, np.where(lay.joined, 0.5 * lay.rest, 0.0)
    if contact is not None and contact.shell is not None:
        shell = contact.shell
        soft_law = shell.law(contact.friction, contact.tangential / contact.normal)
        wide = np.full(len(radius), 0.5 * shell.outer)
    levers = np.zeros((2, n_parts, n_parts)) if patch is None else patch.levers(n_parts)
    return YarnContactGroup(
        radius, half_piece, np.ceil(bend / mean[lay.section]).astype(np.int64), is_piece, lay.chain,
        lay.chain_end_flags(0 if contact is None else contact.cut),
        node_cut, law, part, levers, wide, *_heights(lay, normal),
        _shapes(lay, contact), pressed=contact is not None and contact.pressed,
        compliant=contact is not None and contact.compliant, soft_law=soft_law,
        length=half + np.concatenate([[0.0], half[:-1]]),
    )  # fmt: skip


def _heights(lay: Layout, normal: Array) -> tuple[Array, Array, Array, Array]:
    """Heights (3, n) of the sections at the nodes before they turn and now, squares of the half width and what that of
    the half height is more (n,) [mm^2]; empty if all sections are round.
    """
    radius, wide = lay.section_constant("radius"), lay.section_constant("wide")
    if (wide == radius).all() and not lay.section_constant("squeezable").any():
        return np.zeros((3, 0)), np.zeros((3, 0)), np.zeros(0), np.zeros(0)
    of_elements = np.where(lay.joined[:, None], normal, 0.0)
    height = of_elements + np.roll(of_elements, 1, axis=0)
    height /= np.maximum(np.linalg.norm(height, axis=1, keepdims=True), 1e-12)
    excess = radius**2 - wide**2
    excess[(excess == 0.0) & (lay.section_constant("squeezable") > 0.0)] = -TINY
    return height.T.copy(), height.T.copy(), wide**2, excess


def _shapes(lay: Layout, contact: YarnContact | None) -> Array:
    half = np.where(lay.joined, 0.5 * lay.rest, 0.0)
    length = half + np.concatenate([[0.0], half[:-1]])
    high, wide, stiff, exponent = (lay.section_constant(name) for name in ("radius", "wide", "squeezable", "exponent"))
    stiffest = 0.0 if contact is None else contact.stiffest(float(high.min()))
    return shapes_at_rest(high, wide, stiff, exponent, length, stiffest)


# Bound of the highest frequency of beam chains in contact, node by node and direction by direction.
#
# Every spring of an element or a contact stretches by a sum of w_j n . x_j over its nodes j. By Cauchy and Schwarz x^T
# K x <= sum_i x_i^T B_i x_i with B_i = sum k (sum_j |w_j|) |w_i| n n^T, so omega^2 <= the largest eigenvalue of B_i /
# m_i. Beams are stiff along a yarn and contacts across it, which a bound by sums of stiffnesses does not see. Shear
# turns nodes too; rotary inertia is chosen so that this lowers frequencies
# (:func:`knittest.kernels.beam.rotary_inertia_factor`).


def nodal_loads(chord: Array, joined: Flags, axial: Array, shear: Array, touch: Array, stick: Array) -> Array:
    """Largest eigenvalue of B_i [N/mm], (n_nodes,); omega^2 <= load / mass.

    Element i, if ``joined``, joins nodes i and i + 1 along ``chord`` (n_nodes, 3) with stiffnesses EA / L ``axial`` and
    GA / L ``shear``; contacts add ``touch`` in any direction across the yarn and ``stick`` along it. All (n_nodes,),
    [N/mm].
    """
    length = np.linalg.norm(chord, axis=1, keepdims=True)
    along = np.where(joined[:, None], chord / np.where(joined[:, None], length, 1.0), 0.0)
    beam = 2.0 * np.where(joined, shear, 0.0)[:, None, None] * np.eye(3)
    beam = beam + 2.0 * (axial - shear)[:, None, None] * (along[:, :, None] * along[:, None, :])
    tangent = along.copy()
    beam[1:], tangent[1:] = beam[1:] + beam[:-1], tangent[1:] + tangent[:-1]
    tangent /= np.maximum(np.linalg.norm(tangent, axis=1, keepdims=True), 1e-12)
    contact = touch[:, None, None] * np.eye(3) + (stick - touch)[:, None, None] * (
        tangent[:, :, None] * tangent[:, None, :]
    )
    return np.asarray(np.linalg.eigvalsh(beam + contact)[:, -1])


#: row of the bound by nodes over the penalty, for contacts on a node within a chain and on its end: weights w >= 0 add
#: 2 k w, of contacts one element apart at most 2 k. Half an element beyond its centre-line a yarn's end keeps a contact
#: with weights 9/8, -1/4 and 1/8: k (1 + 3/2) 9/8
CONTACT_STEP_SHARE, END_STEP_SHARE = 2.0, 45.0 / 16.0
#: share of the largest squared frequency of a model that resistance of its crossings to spin may add to it
SPIN_STEP_SHARE = 0.05


@dataclass(frozen=True)
class MassScaling:
    """Critical step [ms] to scale nodal masses to, before the ``safety`` factor, and the largest added share [-]."""

    step: float
    most: float
    safety: float = 1.0


def lump(lay: Layout) -> tuple[Array, Array]:
    """Nodal mass [g] and rotary inertia [g mm^2]."""
    stretch = np.array([c.stretch for c in lay.chains])[lay.chain]
    half = np.where(lay.joined, 0.5 * lay.section_constant("linear_density") * lay.length * stretch, 0.0)
    mass = half.copy()
    mass[1:] += half[:-1]
    spread = np.empty(len(half))
    for s, card in enumerate(lay.cards):
        of = (lay.section == s) & lay.joined
        bending = max(card.bending, card.across or 0.0)
        alpha = rotary_inertia_factor(card.axial, card.shear, card.torsion, bending, lay.mean_length(s))
        spread[lay.section == s] = alpha * float(lay.length[of].max()) ** 2 if of.any() else 1.0
    return mass, spread * mass


def _loads(lay: Layout, mass: Array, inertia: Array, contact: YarnContact | None) -> Array:
    """Largest stiffness [N/mm] that each node feels, see :func:`nodal_loads`."""
    share = np.where(lay.inner_node_flags(), CONTACT_STEP_SHARE, END_STEP_SHARE)
    radius, wide = lay.section_constant("radius"), lay.section_constant("wide")
    turns = mass / inertia
    # a force along the normal of an ellipse turns it by its shift, at most the difference of its half axes
    longest = float(lay.rest[lay.joined].max(initial=0.0))
    touch = contact.stiffest(float(radius.min()), longest) * (1.0 + (wide - radius) ** 2 * turns) if contact else 0.0
    # sticking turns a node by its arm too, and the rotary inertia is mass times inertia / mass
    stick = contact.tangential * (1.0 + wide**2 * turns) if contact else np.zeros(len(mass))
    if contact is not None and contact.shell is not None:  # forces act on the nodes themselves, in any direction
        stick = np.full(len(mass), touch)
    axial, shear = (lay.section_constant(name) / lay.rest for name in ("axial", "shear"))
    return nodal_loads(lay.chord, lay.joined, axial, shear, share * np.maximum(touch, stick), share * stick)


def scale_mass(
    lay: Layout, mass: Array, inertia: Array, contact: YarnContact | None, scaling: MassScaling | None
) -> tuple[float, Array, Array, float, float]:
    """Critical step [ms] by nodes (omega^2 <= load / m), masses for it, the share added, and the stiffness of crossings
    against spin [N mm/rad].

    That of the nodes within the chains, for which ends in contact are made heavy enough, or the target of ``scaling``.
    """
    load = _loads(lay, mass, inertia, contact)
    inner = lay.inner_node_flags() if contact is not None and lay.inner_node_flags().any() else np.full(len(mass), True)
    torsional = 0.0 if contact is None else contact.torsional(_bearable(load, mass, inertia, inner, scaling))
    # the largest frequencies of two sets of springs, squared, are no more than those of both together
    load = load + np.where(lay.inner_node_flags(), CONTACT_STEP_SHARE, END_STEP_SHARE) * torsional * mass / inertia
    steps = 2.0 * np.sqrt(mass / load)
    step = float(steps[inner].min()) if scaling is None else scaling.step
    scaled = np.maximum(mass, 0.25 * step**2 * load)
    added = float(scaled.sum() / mass.sum() - 1.0)
    if scaling is not None and added > scaling.most:
        longest = 1e3 * scaling.safety * longest_step(load, mass, scaling.most, step)
        raise InputError(
            f"solver.target_step adds {100 * added:.1f} % mass, more than solver.max_added_mass = "
            f"{100 * scaling.most:g} %; the unscaled critical step is {1e3 * steps[inner].min():.4f} us; "
            f"solver.target_step={round_down(longest):g} would pass"
        )
    return step, scaled, inertia * scaled / mass, added, torsional


def _bearable(load: Array, mass: Array, inertia: Array, inner: Flags, scaling: MassScaling | None) -> float:
    """Stiffness against spin [N mm/rad] that adds :data:`SPIN_STEP_SHARE` to the largest squared frequency."""
    largest = float((load / mass)[inner].max()) if scaling is None else 4.0 / scaling.step**2
    turned = inertia * np.maximum(load / (mass * largest), 1.0)
    return SPIN_STEP_SHARE * largest * float(turned.min()) / CONTACT_STEP_SHARE


def longest_step(load: Array, mass: Array, most: float, too_long: float) -> float:
    """Step [ms], below one that is ``too_long``, to which nodes of ``mass`` [g] under ``load`` [N/mm], (n,), can be
    scaled with a share of ``most`` [-] added; by bisection.
    """
    low, high = 0.0, too_long
    for _ in range(50):
        middle = 0.5 * (low + high)
        fits = float(np.maximum(mass, 0.25 * middle**2 * load).sum() / mass.sum() - 1.0) <= most
        low, high = (middle, high) if fits else (low, middle)
    return low


def build_chains(
    chains: Sequence[Chain],
    part_names: tuple[str, ...],
    contact: YarnContact | None = None,
    scaling: MassScaling | None = None,
) -> YarnModel:
    """Model of ``chains``, whose nodes are numbered in their order; raises InputError if scaling adds too much mass."""
    used = list(dict.fromkeys((c.section, c.part) for c in chains))
    number = np.array([used.index((c.section, c.part)) for c in chains], np.int64)
    lay = Layout(chains, [card for card, _ in used], number)
    mass, inertia = lump(lay)
    step, mass, inertia, added, torsional = scale_mass(lay, mass, inertia, contact, scaling)
    cells = np.flatnonzero(lay.joined)
    part = np.array([c.part for c in chains], np.int64)[lay.chain]
    mesh = Mesh(
        "beams", np.column_stack([cells, cells + 1]), part[cells], part_names, lay.chain[cells],
        lay.section_constant("radius")[cells],
    )  # fmt: skip
    parts = make_partitions(lay.start, number)
    rotation, tangent = natural_state(lay.start, lay.chord, lay.element_field("degree_of_set"))
    normal = natural_normal(rotation, lay.normals())
    nodes = make_nodes(lay.position, mass, inertia)
    nodes.rotation[:, :-1] = rotation.T
    return YarnModel(
        nodes, parts, mass, inertia, mesh, step, added,
        wave_speed(lay.cards[0].axial, lay.cards[0].linear_density), _beams(lay, tangent, normal), cells,
        np.array([part for _, part in used]), contact_group(lay, mass, parts.node, contact, torsional, part, normal),
        contact is not None,
        bool((lay.element_field("degree_of_set")[lay.joined] < 1.0).any() or (lay.rest < lay.length).any()),
    )  # fmt: skip


def _beams(lay: Layout, tangent: Array, normal: Array) -> Beams:
    knees, slopes = hinge_tables([(card.hinge_strain, card.hinge_slope) for card in lay.cards])
    stiffness = np.array([[c.compression, c.shear, c.torsion, c.bending] for c in lay.cards])
    slack = np.where(lay.joined, lay.element_field("slack"), 0.0)
    return Beams(
        tangent.T.copy(), 1.0 / lay.rest, lay.joined.astype(float), lay.element_field("fail_strain"), slack,
        np.where(lay.joined, np.inf, np.nan), stiffness, knees, slopes, np.array([c.excess for c in lay.cards]),
        normal.T.copy(),
    )  # fmt: skip
