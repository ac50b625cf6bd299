"""Yarns of a deck: each beam element as a resultant beam for bending and a parallel cable for tension.

No resultant beam of the solver has an axial law of rising slope (slack, toe) or a failure strain. So a
Belytschko-Schwer beam (ELFORM 2, *MAT_ELASTIC) has bending and torsion with a small share of the axial stiffness. A
cable (ELFORM 6, *MAT_CABLE_DISCRETE_BEAM) between the same nodes carries the rest of the axial law over engineering
strain, and breaks at the failure strain.
"""

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import InputError
from knittest.export.keywords import KeywordFile
from knittest.models.yarn_model import YarnModel
from knittest.runs.deck.deck_parts import Part, add_nodes, add_part

Array = NDArray[np.float64]
Index = NDArray[np.int64]

#: share of the axial stiffness, and of the mass, that the bending beams have
AXIAL_SHARE, MASS_SHARE = 0.01, 0.1
#: Poisson's ratio of the bending beams' material; it only sets their shear modulus
POISSON = 0.3
#: end of the curves: multiple of the failure strain, or a strain beyond slack for yarns that do not fail
BEYOND, UNBROKEN = 1.2, 0.5
#: distance of the orientation nodes over the size of the specimen
ORIENTATION_DISTANCE = 10.0
NO_FAILURE = 1e20


def cable_law(knee: Array, slope: Array, slack: float, held: float, end: float) -> tuple[Array, Array]:
    """Strain [-] and force [N] of a cable: sum_k slope[k] max(e - slack - knee[k], 0) less held * e, up to ``end``."""
    knot = np.unique(np.concatenate([[0.0], slack + knee[slope != 0.0], [end]]))
    knot = knot[knot <= end]
    more = (slope * np.maximum(knot[:, None] - slack - knee, 0.0)).sum(axis=1) - held * knot
    rises = np.flatnonzero((more[:-1] < 0.0) & (more[1:] > 0.0))
    zero = knot[rises] - more[rises] * np.diff(knot)[rises] / np.diff(more)[rises]
    knot, more = np.append(knot, zero), np.append(more, np.zeros(len(zero)))
    order = np.argsort(knot)
    return knot[order], np.maximum(more[order], 0.0)


def add_yarns(deck: KeywordFile, model: YarnModel) -> list[Part]:
    """Add the yarns; returns the bending beams' parts. Raises :class:`InputError` for elliptic sections."""
    if np.any(model.beams.excess != 0.0) or model.group.excess.size:
        raise InputError("deck: elliptic yarn sections are not supported; leave out fabric.reinforcing.section")
    position, cells, section = model.position(), model.mesh.cells, np.zeros(model.n_nodes, np.int64)
    for first, stop, number in model.parts.span:
        section[first:stop] = number
    section = section[model.element_node]
    length = np.linalg.norm(position[cells[:, 1]] - position[cells[:, 0]], axis=1)
    middle, size = position.mean(axis=0), float(np.ptp(position, axis=0).max())
    deck.comment("nodes of the yarns; the last three only orient the beams, whose sections are round")
    add_nodes(deck, np.vstack([position, middle + ORIENTATION_DISTANCE * size * np.eye(3)]))
    parts, rows = list[Part](), list[tuple[int, ...]]()
    for number in np.unique(section):
        of = section == number
        own = _Section(model, int(number), np.flatnonzero(of), length[of])
        parts.append(Part(own.add_bending(deck), own.name, 2.0 * own.radius))
        rows += own.bending_rows(parts[-1].number, position) + own.add_cables(deck)
    deck.keyword("ELEMENT_BEAM")
    deck.rows("eid:8 pid:8 n1:8 n2:8 n3:8", rows)
    return parts


class _Section:
    """Elements of one section: their ``numbers`` in the mesh and ``length`` [mm]."""

    def __init__(self, model: YarnModel, section: int, numbers: Index, length: Array) -> None:
        self.model, self.section, self.numbers, self.length = model, section, numbers, length
        self.name = model.mesh.part_names[int(model.section_part[section])]
        self.radius = float(model.mesh.radius[numbers[0]])
        self.area = np.pi * self.radius**2
        self.axial = float(np.cumsum(model.beams.hinge_slope[section]).max())  # largest tangent [N]
        nodes = np.unique(model.mesh.cells[numbers])
        self.line_mass = float(model.mass[nodes].sum() / length.sum())  # [g/mm], mass scaling included

    def add_bending(self, deck: KeywordFile) -> int:
        """Add the part of the bending beams; returns its number."""
        _, _, torsion, bending = self.model.beams.stiffness[self.section]
        modulus = AXIAL_SHARE * self.axial / self.area
        shear = modulus / (2.0 * (1.0 + POISSON))
        part, card, beam = (deck.number_for(kind) for kind in ("part", "material", "section"))
        deck.keyword("SECTION_BEAM_TITLE", f"{self.name}: EA / E, EI / E, GJ / G of the resultants")
        deck.card("secid elform shrf qr/irid cst scoor nsm naupd", beam, 2, 1.0, 2, 0, 0.0, 0.0, 0)
        second = float(bending) / modulus
        deck.card("a iss itt j sa ist", self.area, second, second, float(torsion) / shear, 0.0, 0.0)
        deck.keyword("MAT_ELASTIC_TITLE", f"{self.name}: bending, torsion, {AXIAL_SHARE:g} of the axial stiffness")
        deck.card(
            "mid ro e pr da db not_used", card, MASS_SHARE * self.line_mass / self.area, modulus, POISSON, 0, 0, 0
        )
        add_part(deck, f"{self.name}, bending", part, beam, card, "PART_CONTACT")
        deck.card("fs fd dc vc optt sft ssf cparm8", None, None, None, None, 2.0 * self.radius, 1.0, 1.0, None)
        return part

    def bending_rows(self, part: int, position: Array) -> list[tuple[int, ...]]:
        """Rows of the elements, numbered as in the mesh from 1 on, each with its orientation node."""
        cells = self.model.mesh.cells[self.numbers]
        across = np.argmin(np.abs(position[cells[:, 1]] - position[cells[:, 0]]), axis=1)
        third = len(position) + 1 + across
        numbers = np.column_stack([self.numbers + 1, np.full(len(cells), part), cells + 1, third])
        return [tuple(row) for row in numbers.tolist()]

    def add_cables(self, deck: KeywordFile) -> list[tuple[int, ...]]:
        """Add a part of cables for each slack and failure strain; returns the rows of their elements."""
        beams, node = self.model.beams, self.model.element_node[self.numbers]
        kinds, which = np.unique(
            np.column_stack([beams.slack[node], beams.fail_strain[node]]), axis=0, return_inverse=True
        )
        rows: list[tuple[int, ...]] = []
        for kind, (slack, fail) in enumerate(kinds):
            of = np.flatnonzero(which.ravel() == kind)
            part = self._cable_part(deck, float(slack), float(fail), float(self.length[of].mean()))
            element = len(self.model.mesh.cells) + 1 + self.numbers[of]
            cells = self.model.mesh.cells[self.numbers[of]] + 1
            rows += [tuple(row) for row in np.column_stack([element, np.full(len(of), part), cells]).tolist()]
        return rows

    def _cable_part(self, deck: KeywordFile, slack: float, fail: float, length: float) -> int:
        beams = self.model.beams
        breaks = np.isfinite(fail)
        strain, force = cable_law(
            beams.hinge_strain[self.section], beams.hinge_slope[self.section], slack, AXIAL_SHARE * self.axial,
            BEYOND * fail if breaks else slack + UNBROKEN,
        )  # fmt: skip
        title = f"{self.name}: slack {100 * slack:.4g} %, breaks at {100 * fail:.4g} %"
        curve = deck.curve(title, strain, force / self.area)
        part, card, beam = (deck.number_for(kind) for kind in ("part", "material", "section"))
        deck.keyword("SECTION_BEAM_TITLE", f"{self.name}: cable of the mean length, {length:.4g} mm")
        deck.card("secid elform shrf qr/irid cst scoor nsm naupd", beam, 6, 1.0, 2, 0, 0.0, 0.0, 0)
        deck.card("vol iner cid ca offset rrcon srcon trcon", self.area * length, 0.0, 0, self.area, 0.0, 0.0, 0.0, 0.0)
        deck.keyword("MAT_CABLE_DISCRETE_BEAM_TITLE", title)
        density = (1.0 - MASS_SHARE) * self.line_mass / self.area
        deck.card("mid ro e lcid f0 tmaxf0 tramp iread", card, density, self.axial / self.area, curve, 0.0, 0.0, 0.0, 1)
        deck.card("output tstart fracl0 mxeps mxfrc", 1, 0.0, 0.0, fail if breaks else NO_FAILURE, NO_FAILURE)
        add_part(deck, title, part, beam, card)
        return part
