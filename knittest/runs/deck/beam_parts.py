"""Yarns of an LS-DYNA deck, see :mod:`knittest.runs.deck.yarn_sections`.

The beams are Belytschko-Schwer beams (ELFORM 2, *MAT_ELASTIC), the cables ELFORM 6 with *MAT_CABLE_DISCRETE_BEAM.
"""

import numpy as np

from knittest.export.keywords import KeywordFile
from knittest.models.yarn_model import YarnModel
from knittest.runs.deck.deck_parts import Part, add_nodes, add_part
from knittest.runs.deck.yarn_sections import (
    AXIAL_SHARE,
    MASS_SHARE,
    POISSON,
    CableKind,
    YarnSection,
    orientation_nodes,
    orientation_points,
    yarn_sections,
)

NO_FAILURE = 1e20


def add_yarns(deck: KeywordFile, model: YarnModel) -> list[Part]:
    """Add the yarns; returns the bending beams' parts. Raises :class:`InputError` for elliptic sections."""
    sections = yarn_sections(model)
    deck.comment("nodes of the yarns; the last three only orient the beams, whose sections are round")
    add_nodes(deck, np.vstack([model.position(), orientation_points(model)]))
    parts, rows = list[Part](), list[tuple[int, ...]]()
    for own in sections:
        parts.append(Part(_add_bending(deck, own), own.name, 2.0 * own.radius))
        rows += _bending_rows(own, parts[-1].number)
        for kind in own.cable_kinds():
            rows += _add_cables(deck, own, kind)
    deck.keyword("ELEMENT_BEAM")
    deck.rows("eid:8 pid:8 n1:8 n2:8 n3:8", rows)
    return parts


def _add_bending(deck: KeywordFile, own: YarnSection) -> int:
    """Add the part of the bending beams; returns its number."""
    part, card, beam = (deck.number_for(kind) for kind in ("part", "material", "section"))
    deck.keyword("SECTION_BEAM_TITLE", f"{own.name}: EA / E, EI / E, GJ / G of the resultants")
    deck.card("secid elform shrf qr/irid cst scoor nsm naupd", beam, 2, 1.0, 2, 0, 0.0, 0.0, 0)
    deck.card("a iss itt j sa ist", own.area, own.second, own.second, own.polar, 0.0, 0.0)
    deck.keyword("MAT_ELASTIC_TITLE", f"{own.name}: bending, torsion, {AXIAL_SHARE:g} of the axial stiffness")
    deck.card("mid ro e pr da db not_used", card, own.density, own.modulus, POISSON, 0, 0, 0)
    add_part(deck, f"{own.name}, bending", part, beam, card, "PART_CONTACT")
    deck.card("fs fd dc vc optt sft ssf cparm8", None, None, None, None, 2.0 * own.radius, 1.0, 1.0, None)
    return part


def _bending_rows(own: YarnSection, part: int) -> list[tuple[int, ...]]:
    """Rows of the elements, numbered as in the mesh from 1 on, each with its orientation node."""
    cells = own.model.mesh.cells[own.numbers]
    third = orientation_nodes(own.model, cells) + 1
    numbers = np.column_stack([own.numbers + 1, np.full(len(cells), part), cells + 1, third])
    return [tuple(row) for row in numbers.tolist()]


def _add_cables(deck: KeywordFile, own: YarnSection, kind: CableKind) -> list[tuple[int, ...]]:
    """Add the part of the cables of ``kind``; returns the rows of their elements."""
    title, length, mesh = own.cable_title(kind), float(own.length[kind.of].mean()), own.model.mesh
    strain, force = own.cable_curve(kind)
    curve = deck.curve(title, strain, force / own.area)
    part, card, beam = (deck.number_for(kind) for kind in ("part", "material", "section"))
    deck.keyword("SECTION_BEAM_TITLE", f"{own.name}: cable of the mean length, {length:.4g} mm")
    deck.card("secid elform shrf qr/irid cst scoor nsm naupd", beam, 6, 1.0, 2, 0, 0.0, 0.0, 0)
    deck.card("vol iner cid ca offset rrcon srcon trcon", own.area * length, 0.0, 0, own.area, 0.0, 0.0, 0.0, 0.0)
    deck.keyword("MAT_CABLE_DISCRETE_BEAM_TITLE", title)
    density = (1.0 - MASS_SHARE) * own.line_mass / own.area
    deck.card("mid ro e lcid f0 tmaxf0 tramp iread", card, density, own.axial / own.area, curve, 0.0, 0.0, 0.0, 1)
    deck.card("output tstart fracl0 mxeps mxfrc", 1, 0.0, 0.0, kind.fail if kind.breaks else NO_FAILURE, NO_FAILURE)
    add_part(deck, title, part, beam, card)
    element, cells = len(mesh.cells) + 1 + own.numbers[kind.of], mesh.cells[own.numbers[kind.of]] + 1
    numbers = np.column_stack([element, np.full(len(cells), part), cells])
    return [tuple(row) for row in numbers.tolist()]
