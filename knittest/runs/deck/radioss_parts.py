"""Parts of an OpenRadioss deck: shells, yarns, contact, constraints, motions, guides and time histories.

Each function names its keywords of the Radioss reference guide (Altair, 2021 to 2026). The columns were checked against
the definitions of OpenRadioss' own reader (hm_cfg_files, input version 2026).

How a yarn breaks: the curve of the cable (/SPRING) falls to zero at its failure strain. The engine compares DeltaMax
with the elongation in mm, not with the strain of Ileng = 1, so DeltaMax only deletes the broken cable. The beam between
the same nodes fails at the same engineering strain (/FAIL/TENSSTRAIN, Epsilon_f2 of the signed axial strain), and its
force falls to zero over about ten steps. Then their contact segment is removed (/INTER/TYPE11, Idel = 2).
"""

from collections import defaultdict
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from knittest.base.arrays import Index
from knittest.base.errors import InputError
from knittest.export.blocks import BlockFile
from knittest.kernels.state import ContactLaw, Drive
from knittest.models.explicit_model import ExplicitModel
from knittest.models.fabric_model import FabricModel
from knittest.models.tool import Table
from knittest.models.yarn_contact import CONTACT_DAMPING
from knittest.models.yarn_model import YarnModel
from knittest.runs.deck.drives import AXES, Load, constraints, knots_of, loads_of
from knittest.runs.deck.sheet_layers import LAYERS, fibre_curves, shear_curve, sheet_of
from knittest.runs.deck.yarn_sections import (
    MASS_SHARE,
    POISSON,
    CableKind,
    YarnSection,
    orientation_nodes,
    orientation_points,
    yarn_sections,
)

Array = NDArray[np.float64]

#: Ishell: fully integrated shells (QBAT). Ismstr: large strains. Ithick: constant thickness. Ipos: given layer places
QBAT, LARGE_STRAINS, CONSTANT_THICKNESS, OWN_PLACES = 12, 4, 2, 1
#: crimp of the fibres of LAW158, nearly straight; modulus over the curves' stiffness, and its least value [MPa], that
#: keeps it; modulus [MPa] of the coupling of both fibres, as good as none
STRAIGHT, CRIMP_RATIO, LEAST_CRIMP_MODULUS, COUPLING = 1e-4, 10.0, 1e4, 1e-9
#: angle [deg] between warp and weft in the layers
RIGHT_ANGLE = 90.0
#: Ileng of /PROP/TYPE4: mass per length, force over strain; Ishear of /PROP/TYPE3: without transverse shear
PER_LENGTH, NO_SHEAR = 1, 1
#: S_Flag of /FAIL/TENSSTRAIN: engineering strain; Epsilon_f1 of its equivalent strain: never
ENGINEERING, NEVER = 11, 1e20
#: a cable carries no force down to this strain; its force falls to zero within this share of its failure strain
SHORTEST, FALL = -1.0, 1e-3
#: Istf of /INTER/TYPE11: Stfac is the penalty stiffness; Igap: Gapmin is the gap; Idel: segments go with any element;
#: Inacti: an initial penetration shortens the gap there by itself (6: by 5 % of the distance more, a clearance); Iform:
#: friction by a tangential stiffness
OWN_STIFFNESS, OWN_GAP, WITH_ANY_ELEMENT, REMOVED, INCREMENTAL = 1, 1000, 2, 5, 2
#: Stfac over the stiffness of a pair: the engine puts both sides in series, Stfac / 2, and halves this
OF_PAIR = 4.0
#: a time that no run reaches
ALWAYS = 1e30
#: directions of /IMPVEL and /GRAV by the degree of freedom
DIRECTIONS = ("X", "Y", "Z", "XX", "YY", "ZZ")
#: bands of the places of nodes that share a guide's acceleration: it is right to a four-hundredth of its range
BANDS = 200


def add_nodes(deck: BlockFile, points: Array) -> None:
    """Add /NODE at ``points`` (n, 3), numbered from 1 on."""
    deck.block("NODE")
    deck.rows("node_ID:10 Xc:20 Yc:20 Zc:20", ((n, *point) for n, point in enumerate(points.tolist(), 1)))


def add_part(deck: BlockFile, title: str, prop: int, material: int) -> int:
    """Add /PART; returns its number."""
    part = deck.number_for("part")
    deck.block(f"PART/{part}", title)
    deck.card("prop_ID mat_ID subset_ID Thick:20", prop, material, 0, None)
    return part


def add_sheet(deck: BlockFile, model: FabricModel) -> None:
    """Add nodes, /SHELL, /PROP/TYPE16 with three layers and their /MAT/LAW158.

    The layers lie at the offset of the laminate and are a third of its distance thick, so that they reach beyond the
    outer ones: the density is that of the whole thickness. LAW158 takes nominal stress over the fibre's engineering
    strain, and shear stress over the angle [deg] between the fibres.
    """
    add_nodes(deck, model.position())
    card, sheet = model.laminate, sheet_of(model)
    ply = sheet.thick / LAYERS
    total = sheet.thick + ply
    angle, shear = shear_curve(card)
    shear_function = deck.function(
        "fabric: shear stress [MPa] over the shear angle [deg]", np.degrees(angle), shear / (LAYERS * ply)
    )
    tension = [fibre_curves(card, direction) for direction in range(2)]
    materials = []
    for layer, name in enumerate(("outer layers", "middle layer")):
        curves = [(strain, force / ply) for strain, force in (both[layer] for both in tension)]
        stiffest = max(float(np.abs(np.diff(stress) / np.diff(strain)).max()) for strain, stress in curves)
        functions = [
            deck.function(f"{name}: {yarns}, stress [MPa] over strain", *curve)
            for yarns, curve in zip(("warp", "weft"), curves, strict=True)
        ]
        materials.append(deck.number_for("material"))
        crimp = max(LEAST_CRIMP_MODULUS, CRIMP_RATIO * stiffest)
        deck.block(f"MAT/LAW158/{materials[-1]}", f"fabric, {name}: fibres along warp and weft")
        deck.card("RHO_I:20", sheet.area_mass / total)
        deck.card("S1:20 S2:20 FLEX:20 FLEX1:20 FLEX2:20", STRAIGHT, STRAIGHT, COUPLING, crimp, crimp)
        deck.card("ZERO_STRESS:20 : sensor_ID", 0.0, None, 0)
        for number in (*functions, shear_function):
            deck.card("fct_ID : Fscale:20", number, None, 1.0)
        deck.card("fct_ID4 fct_ID5", 0, 0)
    prop = deck.number_for("property")
    deck.block(f"PROP/TYPE16/{prop}", "fabric: layers at the laminate's offset, not at the fabric's faces")
    deck.card("Ishell Ismstr Ish3n :30 P_Thick_Fail:20", QBAT, LARGE_STRAINS, 2, None, 0.0)
    deck.card("Hm:20 Hf:20 Hr:20 Dm:20 Dn:20", 0.0, 0.0, 0.0, 0.0, 0.0)
    deck.card("N Istrain Thick:20 Ashear:20 : Ithick", LAYERS, 0, total, 0.0, None, CONSTANT_THICKNESS)
    deck.card("Vx:20 Vy:20 Vz:20 skew_ID Ipos : Ip", *sheet.warp.tolist(), 0, OWN_PLACES, None, 0)
    places = ((-0.5, materials[0]), (0.0, materials[1]), (0.5, materials[0]))
    rows = [(0.0, RIGHT_ANGLE, ply, place * sheet.thick, material) for place, material in places]
    deck.rows("Phi_i:20 Alpha_i:20 t_i:20 Z_i:20 mat_IDi", rows)
    part = add_part(deck, "fabric", prop, materials[0])
    deck.block(f"SHELL/{part}")
    cells = (model.mesh.cells + 1).tolist()
    deck.rows("shell_ID node_ID1 node_ID2 node_ID3 node_ID4", ((e, *corners) for e, corners in enumerate(cells, 1)))


def add_yarns(deck: BlockFile, model: YarnModel) -> dict[int, list[int]]:
    """Add nodes, beams and cables; returns the parts of the beams of each system, by its number in the mesh.

    Raises :class:`InputError` for elliptic sections.
    """
    sections = yarn_sections(model)
    deck.comment("nodes of the yarns; the last three only orient the beams, whose sections are round")
    add_nodes(deck, np.vstack([model.position(), orientation_points(model)]))
    parts: dict[int, list[int]] = defaultdict(list)
    for own in sections:
        prop = _add_beam_property(deck, own)
        for kind in own.cable_kinds():
            parts[own.system].append(_add_beams(deck, own, kind, prop))
            _add_cables(deck, own, kind)
    return dict(parts)


def _add_beam_property(deck: BlockFile, own: YarnSection) -> int:
    """Add /PROP/TYPE3 (BEAM): resultants of the section; returns its number."""
    prop = deck.number_for("property")
    deck.block(f"PROP/TYPE3/{prop}", f"{own.name}: EA / E, EI / E, GJ / G of the resultants")
    deck.card(": Ismstr", None, LARGE_STRAINS)
    deck.card("Dm:20 Df:20", 0.0, 0.0)
    deck.card("Area:20 Iyy:20 Izz:20 Ixx:20", own.area, own.second, own.second, own.polar)
    deck.card("Wdof Ishear", "000 000", NO_SHEAR)
    return prop


def _add_beams(deck: BlockFile, own: YarnSection, kind: CableKind, prop: int) -> int:
    """Add /MAT/LAW1 (ELAST), /FAIL/TENSSTRAIN, /PART and /BEAM of the elements of ``kind``; returns the part."""
    title, material = f"{own.cable_title(kind)}, bending", deck.number_for("material")
    deck.block(f"MAT/LAW1/{material}", title)
    deck.card("RHO_I:20", own.density)
    deck.card("E:20 nu:20", own.modulus, POISSON)
    if kind.breaks:
        deck.block(f"FAIL/TENSSTRAIN/{material}")
        names = "Epsilon_t1:20 Epsilon_t2:20 fct_ID Epsilon_f1:20 Epsilon_f2:20 S_Flag"
        deck.card(names, 0.0, 0.0, 0, NEVER, kind.fail, ENGINEERING)
        deck.card("FAILIP", 0)
    part = add_part(deck, title, prop, material)
    numbers = own.numbers[kind.of]
    cells = own.model.mesh.cells[numbers]
    third = orientation_nodes(own.model, cells)
    deck.block(f"BEAM/{part}")
    rows = np.column_stack([numbers, cells, third]) + 1
    deck.rows("beam_ID node_ID1 node_ID2 node_ID3", rows.tolist())
    return part


def _add_cables(deck: BlockFile, own: YarnSection, kind: CableKind) -> None:
    """Add /PROP/TYPE4 (SPRING) with its force over strain, /PART and /SPRING of the elements of ``kind``."""
    title, mesh, prop = own.cable_title(kind), own.model.mesh, deck.number_for("property")
    strain, force = own.cable_curve(kind)
    longest = 1.0
    if kind.breaks:
        whole = strain < kind.fail
        force = np.concatenate([force[whole], [np.interp(kind.fail, strain, force), 0.0, 0.0]])
        strain = np.concatenate([strain[whole], kind.fail * np.array([1.0, 1.0 + FALL, 2.0])])
        longest = max(1.0, float(own.length[kind.of].max()))
    function = deck.function(f"{title}: force [N]", np.append(SHORTEST, strain), np.append(0.0, force))
    deck.block(f"PROP/TYPE4/{prop}", title)
    mass = (1.0 - MASS_SHARE) * own.line_mass
    deck.card("MASS:20 :30 sens_ID Isflag Ileng", mass, None, 0, 0, PER_LENGTH)
    deck.card("K1:20 C1:20 A1:20 B1:20 D1:20", own.axial, 0.0, 0.0, 0.0, 0.0)
    names = "fct_ID11 H1 fct_ID21 fct_ID31 fct_ID41 : DeltaMin1:20 DeltaMax1:20"
    deck.card(names, function, 0, 0, 0, 0, None, 0.0, kind.fail * longest if kind.breaks else 0.0)
    deck.card("F1:20 E1:20 Ascale1:20 Hscale1:20", 0.0, 0.0, 0.0, 0.0)
    part = add_part(deck, title, prop, 0)
    numbers = own.numbers[kind.of]
    deck.block(f"SPRING/{part}")
    rows = np.column_stack([len(mesh.cells) + numbers, mesh.cells[numbers]]) + 1
    deck.rows("sprg_ID node_ID1 node_ID2", rows.tolist())


def add_yarn_contact(deck: BlockFile, model: YarnModel, parts: dict[int, list[int]]) -> None:
    """Add /INTER/TYPE11 between each two systems, and within a system between its odd and its even yarns.

    Neighbouring elements of one yarn are nearer to each other than its diameter, so a yarn does not touch itself.
    """
    names, radius = model.mesh.part_names, {s: _radius(model, s) for s in parts}
    lines = {}
    for system, own in parts.items():
        lines[system] = deck.number_for("line")
        deck.block(f"LINE/PART/{lines[system]}", names[system])
        deck.numbers(own)
    for one, other in combinations(parts, 2):
        title = f"{names[one]} with {names[other]}"
        _add_interface(deck, title, (lines[one], lines[other]), model.group.law, radius[one] + radius[other])
    for system in parts:
        halves = yarn_halves(model, system)
        if len(halves) == 2:
            sides = [_add_line(deck, f"{names[system]}, {name} yarns", half) for name, half in halves.items()]
            title = f"{names[system]} with itself"
            _add_interface(deck, title, (sides[0], sides[1]), model.group.law, 2.0 * radius[system])


def _radius(model: YarnModel, system: int) -> float:
    return float(model.mesh.radius[model.mesh.part == system][0])


def yarn_halves(model: YarnModel, system: int) -> dict[str, Index]:
    """Elements, from 0 on, of every second yarn of ``system`` and of those between, in the order of their places."""
    elements = np.flatnonzero(model.mesh.part == system)
    yarn = model.group.chain[model.element_node[elements]]
    middle = model.position()[model.mesh.cells[elements]].mean(axis=1)
    yarns = np.unique(yarn)
    places = np.array([middle[yarn == one].mean(axis=0) for one in yarns])
    across = places[:, np.argmax(np.ptp(places, axis=0))]
    rank = dict(zip(yarns.tolist(), np.argsort(np.argsort(across, kind="stable")).tolist(), strict=True))
    odd = np.array([rank[int(one)] % 2 for one in yarn])
    return {name: elements[odd == side] for side, name in enumerate(("odd", "even")) if (odd == side).any()}


def _add_line(deck: BlockFile, title: str, elements: Index) -> int:
    """Add /GRBEAM/BEAM and /LINE/GRBEAM of ``elements``; returns the number of the line."""
    group, line = deck.number_for("beam group"), deck.number_for("line")
    deck.block(f"GRBEAM/BEAM/{group}", title)
    deck.numbers(elements + 1)
    deck.block(f"LINE/GRBEAM/{line}", title)
    deck.numbers([group])
    return line


def _add_interface(deck: BlockFile, title: str, lines: tuple[int, int], law: ContactLaw, gap: float) -> None:
    """Add /INTER/TYPE11 between two ``lines`` that touch at the distance ``gap`` [mm] of their axes."""
    deck.block(f"INTER/TYPE11/{deck.number_for('interface')}", title)
    names = "line_IDs line_IDm Istf Ithe Igap : Irem_gap Idel"
    deck.card(names, *lines, OWN_STIFFNESS, 0, OWN_GAP, None, 0, WITH_ANY_ELEMENT)
    deck.card("Stmin:20 Stmax:20 mesh_size:20 dtmin:20 Iform sens_ID", 0.0, 0.0, 0.0, 0.0, INCREMENTAL, 0)
    deck.card("Stfac:20 Fric:20 Gapmin:20 Tstart:20 Tstop:20", OF_PAIR * law.normal, law.kinetic, gap, 0.0, 0.0)
    deck.card("IBC :20 Inacti VISs:20 VISF:20 Bumult:20", "000", None, REMOVED, CONTACT_DAMPING, 0.0, 0.0)
    deck.card(":90 fric_ID", None, 0)


def add_motions(
    deck: BlockFile, model: ExplicitModel, drive: Drive, tables: list[Table], end: float, damping: float
) -> Index:
    """Add /BCS, /IMPVEL, /DAMP and guides (/GRAV) up to ``end`` [ms]; returns the moved nodes, from 0 on.

    Raises :class:`InputError` for motions along oblique axes.
    """
    held, moved = constraints(model, drive, tables)
    for one in held:
        group, number = deck.node_group(one.title, one.nodes + 1), deck.number_for("condition")
        deck.block(f"BCS/{number}", one.title)
        digits = "".join(str(int(flag)) for flag in one.flags)
        deck.card("Tra_rot skew_ID grnod_ID", f"{digits[:3]} {digits[3:]}", 0, group)
    functions: dict[int, int] = {}
    for table, axis, nodes, scale in moved:
        if table not in functions:
            title = f"velocity {table} [mm/ms] over time [ms]"
            functions[table] = deck.function(title, *knots_of(tables[table], end))
        for share in np.unique(scale):
            title = f"moved along {AXES[axis]}"
            group, number = deck.node_group(title, nodes[scale == share] + 1), deck.number_for("motion")
            deck.block(f"IMPVEL/{number}", title)
            names = "fct_IDT Dir skew_ID sensor_ID grnod_ID frame_ID Icoor"
            deck.card(names, functions[table], DIRECTIONS[axis], 0, 0, group, 0, 0)
            deck.card("Ascale_x:20 Fscale_Y:20 Tstart:20 Tstop:20", 1.0, float(share), 0.0, ALWAYS)
    if damping > 0.0:
        group = deck.node_group("all nodes", range(1, model.n_nodes + 1))
        deck.block("DAMP/1", "mass-proportional damping")
        deck.card("Alpha:20 Beta:20 grnod_ID skew_ID Tstart:20 Tstop:20", damping, 0.0, group, 0, 0.0, ALWAYS)
    _add_guides(deck, model, list(loads_of(drive, tables, damping)), end)
    return np.unique(np.concatenate([one.nodes for one in moved]))


def _add_guides(deck: BlockFile, model: ExplicitModel, loads: list[Load], end: float) -> None:
    """Add /GRAV: the acceleration of a guide times its scale, on the nodes of each of :data:`BANDS` of scales."""
    runs: dict[tuple[int, int], list[Load]] = defaultdict(list)
    if not all(load.guides for load in loads):
        raise InputError("deck for openradioss: forces on nodes are not supported; expected motions and guides only")
    for load in loads:
        runs[id(load.table), load.axis].append(load)
    functions: dict[int, int] = {}
    for (table, axis), own in runs.items():
        nodes = np.concatenate([load.nodes for load in own])
        scale = np.concatenate([load.value for load in own]) / model.mass[nodes]
        if table not in functions:
            title = "acceleration of a guide over its scale, and damping times its velocity"
            functions[table] = deck.function(title, *knots_of(own[0].table, end))
        band = np.round(scale * BANDS / max(float(np.ptp(scale)), np.finfo(float).tiny)).astype(np.int64)
        for one in np.unique(band[band != 0]):
            of = band == one
            mean = float(np.average(scale[of], weights=model.mass[nodes[of]]))
            title = f"guided along {AXES[axis]}"
            group, number = deck.node_group(title, nodes[of] + 1), deck.number_for("gravity")
            deck.block(f"GRAV/{number}", title)
            names = "fct_IDT Dir skew_ID sensor_ID grnod_ID : Ascale_x:20 Fscale_Y:20"
            deck.card(names, functions[table], DIRECTIONS[axis], 0, 0, group, None, 1.0, mean)


def add_history(deck: BlockFile, nodes: Index) -> None:
    """Add /TH/NODE: displacements and reaction impulses of ``nodes``, from 0 on, along x and y."""
    deck.block("TH/NODE/1", "nodes that the test moves")
    deck.lines.append("".join(f"{name:<10}" for name in ("DX", "DY", "REACX", "REACY")))
    deck.rows("node_ID skew_ID", ((int(node) + 1, 0) for node in nodes))
