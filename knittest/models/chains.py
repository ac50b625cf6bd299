"""Assembles beam chains: one chain a yarn, lumped masses, critical step, contact group."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from knittest.base.history import Mesh
from knittest.kernels.beam import wave_speed
from knittest.kernels.state import Beams
from knittest.models.chain_contact import contact_group
from knittest.models.chain_layout import Chain, Layout
from knittest.models.chain_step import MassScaling, lump, scale_mass
from knittest.models.explicit_model import make_nodes, make_partitions
from knittest.models.natural_state import natural_normal, natural_state
from knittest.models.yarn_contact import YarnContact
from knittest.models.yarn_model import YarnModel

Array = NDArray[np.float64]


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
        lay.of_card("radius")[cells],
    )  # fmt: skip
    parts = make_partitions(lay.start, number)
    rotation, tangent = natural_state(lay.start, lay.chord, lay.of_elements("degree_of_set"))
    normal = natural_normal(rotation, lay.normals())
    nodes = make_nodes(lay.position, mass, inertia)
    nodes.rotation[:, :-1] = rotation.T
    return YarnModel(
        nodes, parts, mass, inertia, mesh, step, added,
        wave_speed(lay.cards[0].axial, lay.cards[0].linear_density), _beams(lay, tangent, normal), cells,
        np.array([part for _, part in used]), contact_group(lay, mass, parts.node, contact, torsional, part, normal),
        contact is not None,
        bool((lay.of_elements("degree_of_set")[lay.joined] < 1.0).any() or (lay.rest < lay.length).any()),
    )  # fmt: skip


def _beams(lay: Layout, tangent: Array, normal: Array) -> Beams:
    n_hinges = max(len(c.hinge_strain) for c in lay.cards)
    knees, slopes = np.zeros((len(lay.cards), n_hinges)), np.zeros((len(lay.cards), n_hinges))
    for s, card in enumerate(lay.cards):
        knees[s, : len(card.hinge_strain)] = card.hinge_strain
        slopes[s, : len(card.hinge_slope)] = card.hinge_slope
    stiffness = np.array([[c.compression, c.shear, c.torsion, c.bending] for c in lay.cards])
    slack = np.where(lay.joined, lay.of_elements("slack"), 0.0)
    return Beams(
        tangent.T.copy(), 1.0 / lay.rest, lay.joined.astype(float), lay.of_elements("fail_strain"), slack,
        np.where(lay.joined, np.inf, np.nan), stiffness, knees, slopes, np.array([c.excess for c in lay.cards]),
        normal.T.copy(),
    )  # fmt: skip
