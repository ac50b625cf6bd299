"""Parts of an LS-DYNA deck: the fabric, rigid tools of forming, motions and loads, contact.

*MAT_REINFORCED_THERMOPLASTIC (249) has the law of the shell elements: fibres along warp and weft that turn with the
fabric, a curve of stress over strain for each, and one of shear over the angle between them. Its layers lie at the
offset of the laminate (*INTEGRATION_SHELL), so that tension and bending are independent.
"""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from knittest.export.keywords import KeywordFile, Value
from knittest.kernels.state import Drive
from knittest.kernels.tool_contact import FREE, HELD
from knittest.laboratory.forming.rig import FormingTest
from knittest.models.boundary import Boundary
from knittest.models.explicit_model import ExplicitModel
from knittest.models.fabric_model import FabricModel
from knittest.models.surface import TriangleMesh
from knittest.models.tool import Table, Tool
from knittest.models.yarn_contact import CONTACT_DAMPING
from knittest.runs.deck.drives import AXES, constraints, knots_of, loads_of
from knittest.runs.deck.sheet_layers import LAYERS, Sheet, fibre_curves, shear_curve, sheet_of

Array = NDArray[np.float64]

#: modulus of the matrix, which the material requires, over the smallest shear modulus of the fibres
MATRIX_SHARE = 1e-2
#: yield stress over the modulus of the matrix: it never yields
YIELD_STRESS_RATIO = 1e6


class Part(NamedTuple):
    """Number, name and thickness [mm] of a part in contact."""

    number: int
    name: str
    thickness: float


def add_block(deck: KeywordFile, keyword: str, names: str, *values: Value, title: str | None = None) -> None:
    """Add ``keyword``, with its ``title``, and its first card."""
    deck.keyword(keyword, title)
    deck.card(names, *values)


def add_part(deck: KeywordFile, title: str, part: int, section: int, material: int, keyword: str = "PART") -> None:
    """Add a part."""
    names = "pid secid mid eosid hgid grav adpopt tmid"
    add_block(deck, keyword, names, part, section, material, 0, 0, 0, 0, 0, title=title)


def add_nodes(deck: KeywordFile, points: Array) -> int:
    """Add nodes at ``points`` (n, 3); returns the number of the first."""
    first = deck.given.get("node", 0) + 1
    deck.given["node"] = first - 1 + len(points)
    deck.keyword("NODE")
    deck.rows("nid:8 x:16 y:16 z:16 tc:8 rc:8", ((n, *point, 0, 0) for n, point in enumerate(points.tolist(), first)))
    return first


def add_sheet(deck: KeywordFile, model: FabricModel) -> Part:
    """Add nodes, shell elements, section, layers and their materials; returns the part of the fabric."""
    add_nodes(deck, model.position())
    sheet = sheet_of(model)
    thick = sheet.thick
    materials, section = _materials(deck, model, sheet), deck.number_for("section")
    fabric, plies = deck.number_for("part"), [deck.number_for("part") for _ in range(2)]
    add_block(deck, "INTEGRATION_SHELL", "irid nip esop failopt", 1, LAYERS, 0, 0)
    share = 1.0 / LAYERS
    deck.rows("s wf pid", [(-1.0, share, plies[0]), (0.0, share, plies[1]), (1.0, share, plies[0])])
    deck.keyword("SECTION_SHELL_TITLE", "fabric: layers at the laminate's offset, not at the fabric's faces")
    deck.card("secid elform shrf nip propt qr/irid icomp setyp", section, 16, 1.0, LAYERS, 0, -1, 0, 1)
    deck.card("t1 t2 t3 t4 nloc marea idof edgset", thick, thick, thick, thick, 0, 0, 0, 0)
    surface = 2.0 * float(model.mesh.radius[0])
    add_part(deck, "fabric", fabric, section, materials[1], "PART_CONTACT")
    deck.card("fs fd dc vc optt sft ssf cparm8", None, None, None, None, surface, 1.0, 1.0, None)
    for ply, material, name in zip(plies, materials, ("outer layers", "middle layer"), strict=True):
        add_part(deck, f"{name}, without elements", ply, section, material)
    deck.keyword("ELEMENT_SHELL")
    cells = (model.mesh.cells + 1).tolist()
    deck.rows("eid:8 pid:8 n1:8 n2:8 n3:8 n4:8", ((e, fabric, *corners) for e, corners in enumerate(cells, 1)))
    return Part(fabric, "fabric", surface)


def _materials(deck: KeywordFile, model: FabricModel, sheet: Sheet) -> list[int]:
    card, thick, warp = model.laminate, sheet.thick, sheet.warp
    density, ply = sheet.area_mass / thick, thick / LAYERS
    angle, force = shear_curve(card)
    shear = deck.curve("fabric: shear stress [MPa] over the shear angle [rad]", angle, force / thick)
    softest = float((force[angle > 0.0] / angle[angle > 0.0]).min()) / thick
    matrix = MATRIX_SHARE * softest
    hardening = deck.curve(
        "matrix: it never yields", [0.0, 1.0], [YIELD_STRESS_RATIO * matrix, YIELD_STRESS_RATIO * matrix]
    )
    tension = [fibre_curves(card, direction) for direction in range(2)]
    numbers = []
    for layer, name in enumerate(("outer layers", "middle layer")):
        curves = [
            deck.curve(f"{name}: {yarns}, stress [MPa] over strain", strain, force / ply)
            for yarns, (strain, force) in zip(("warp", "weft"), (t[layer] for t in tension), strict=True)
        ]
        numbers.append(deck.number_for("material"))
        deck.keyword("MAT_REINFORCED_THERMOPLASTIC_TITLE", f"fabric, {name}: fibres along warp and weft")
        deck.card("mid ro em lcem prm lcprm lcsigy beta", numbers[-1], density, matrix, 0, 0.0, 0, hardening, 0.0)
        across = np.cross([0.0, 0.0, 1.0], warp)
        deck.card("nfib aopt u u u a1 a2 a3", 2, 2.0, None, None, None, *warp.tolist())
        deck.card("v1 v2 v3 d1 d2 d3 mangl thick", 0.0, 0.0, 0.0, *across.tolist(), 0.0, 0.0)
        first, second = (float(card.transverse[k]) / thick for k in range(2))
        deck.card("idf1 alph1 ef1 lcef1 g23_1 g31_1", 1, 0.0, 0.0, curves[0], 0.0, first)
        deck.card("g12 lcg12 aloc12 gloc12 meth12", 0.0, shear, 0.0, 0.0, 2)
        deck.card("idf2 alph2 ef2 lcef2 g23_2 g31_2", 2, 90.0, 0.0, curves[1], 0.0, second)
        deck.card("g23 lcg23 aloc23 gloc23 meth23", 0.0, 0, 0.0, 0.0, 0)
        deck.card("idf3 alph3 ef3 lcef3 g23_3 g31_3", 0, 0.0, 0.0, 0, 0.0, 0.0)
        deck.card("postv ihis", 0, 0.0)
    return numbers


#: degrees of freedom in the deck by those of the kernel
DOF = (1, 2, 3, 5, 6, 7)
VELOCITY = 0


def add_curve(deck: KeywordFile, title: str, table: Table, end: float) -> int:
    """Add ``table`` from 0 to beyond ``end`` [ms]; returns its number."""
    return deck.curve(title, *knots_of(table, end))


def add_set(deck: KeywordFile, kind: str, title: str, members: Iterable[int]) -> int:
    """Add a set of nodes or parts (``kind``); returns its number."""
    number = deck.number_for(f"{kind} set")
    deck.keyword(f"SET_{kind.upper()}_LIST_TITLE", title)
    deck.card("sid da1 da2 da3 da4 solver", number, 0.0, 0.0, 0.0, 0.0, "MECH")
    deck.numbers(members)
    return number


def add_motions(
    deck: KeywordFile, model: ExplicitModel, drive: Drive, tables: list[Table], end: float, damping: float
) -> None:
    """Add constraints, motions, loads of ``drive`` up to ``end`` [ms]; raises :class:`InputError` for oblique ones."""
    held, moved = constraints(model, drive, tables)
    for one in held:
        nodes = add_set(deck, "node", one.title, one.nodes + 1)
        names = "nsid cid dofx dofy dofz dofrx dofry dofrz"
        add_block(deck, "BOUNDARY_SPC_SET", names, nodes, 0, *(int(flag) for flag in one.flags))
    curves: dict[int, int] = {}
    for table, axis, nodes_moved, share in moved:
        if table not in curves:
            curves[table] = add_curve(deck, f"velocity {table} [mm/ms] over time [ms]", tables[table], end)
        numbers, keyword = nodes_moved + 1, "BOUNDARY_PRESCRIBED_MOTION_NODE"
        if np.all(share == share[0]):  # one set, else a row for each node with its share of the curve
            numbers, share = np.array([add_set(deck, "node", f"moved along {AXES[axis]}", numbers)]), share[:1]
            keyword = "BOUNDARY_PRESCRIBED_MOTION_SET"
        deck.keyword(keyword)
        rows = [(int(n), DOF[axis], VELOCITY, curves[table], float(s)) for n, s in zip(numbers, share, strict=True)]
        deck.rows("id dof vad lcid sf", rows)
    _add_loads(deck, drive, tables, end, damping)


def _add_loads(deck: KeywordFile, drive: Drive, tables: list[Table], end: float, damping: float) -> None:
    curves, rows = dict[int, int](), list[tuple[int, int, int, float]]()
    for load in loads_of(drive, tables, damping):
        if id(load.table) not in curves:
            title = "acceleration of a guide over its scale" if load.guides else "load over its size"
            curves[id(load.table)] = add_curve(deck, title, load.table, end)
        curve = curves[id(load.table)]
        rows += [
            (int(node) + 1, DOF[load.axis], curve, float(value))
            for node, value in zip(load.nodes, load.value, strict=True)
            if value != 0.0  # the solver reads a factor of 0 as its default, 1
        ]
    if rows:
        deck.keyword("LOAD_NODE_POINT")
        deck.rows("nid dof lcid sf", rows)


#: thickness of the tools' shell elements, for the mass of a free tool [mm], and their thickness in contact [mm]
THICK, SEEN = 1.0, 0.01
#: steel of the rigid tools: density [g/mm3], modulus [MPa], Poisson's ratio
STEEL, MODULUS, POISSON = 7.85e-3, 210e3, 0.3
#: a floor is wider than the blank by this factor
FLOOR_FACTOR = 1.5
#: fixed degrees of freedom of *MAT_RIGID: x and y, or all three
ALONG_Z, FIXED = 4, 7
DOF_Z = 3


def add_tools(deck: KeywordFile, rig: FormingTest, boundary: Boundary, end: float, first_element: int) -> list[int]:
    """Add the tools after the nodes and elements of the fabric, with motions and loads; returns their parts."""
    deck.given["element"] = first_element - 1
    section = deck.number_for("section")
    deck.keyword("SECTION_SHELL_TITLE", "tools")
    deck.card("secid elform shrf nip propt qr/irid icomp setyp", section, 2, 1.0, 2, 0, 0, 0, 1)
    deck.card("t1 t2 t3 t4 nloc marea idof edgset", THICK, THICK, THICK, THICK, 0, 0, 0, 0)
    parts = []
    surfaces = {name: tool.solid for name, tool in rig.tools.by_name.items()}
    if rig.floor is not None:
        place = boundary.model.position()[:, :2]
        (x0, y0), (x1, y1) = FLOOR_FACTOR * place.min(axis=0), FLOOR_FACTOR * place.max(axis=0)
        corners = np.array([[x, y, rig.floor] for x, y in ((x0, y0), (x1, y0), (x1, y1), (x0, y1))])
        surfaces["floor"] = TriangleMesh(corners, np.array([[0, 1, 2], [0, 2, 3]]))
    for (name, surface), tool in zip(surfaces.items(), boundary.tools, strict=True):
        parts.append(_add_tool(deck, name, surface, tool, section))
        motion, load = tool.motion[2], tool.load[2]
        if motion >= 0:
            curve = add_curve(deck, f"velocity of the {name} [mm/ms] over time [ms]", boundary.tables[motion], end)
            keyword = "BOUNDARY_PRESCRIBED_MOTION_RIGID"
            add_block(deck, keyword, "pid dof vad lcid sf", parts[-1], DOF_Z, VELOCITY, curve, 1.0)
        if load >= 0:
            curve = add_curve(deck, f"force on the {name} [N] over time [ms]", boundary.tables[load], end)
            add_block(deck, "LOAD_RIGID_BODY", "pid dof lcid sf", parts[-1], DOF_Z, curve, 1.0)
    return parts


def _add_tool(deck: KeywordFile, name: str, surface: TriangleMesh, tool: Tool, section: int) -> int:
    part, card = deck.number_for("part"), deck.number_for("material")
    free, area = tool.motion[2] != HELD, float(np.linalg.norm(surface.normals, axis=1).sum())
    density = tool.mass / (area * THICK) if tool.motion[2] == FREE else STEEL
    deck.keyword("MAT_RIGID_TITLE", name)
    deck.card("mid ro e pr n couple m alias", card, density, MODULUS, POISSON, 0.0, 0.0, 0.0, None)
    deck.card("cmo con1 con2", 1.0, ALONG_Z if free else FIXED, FIXED)
    deck.card("lco_or_a1 a2 a3 v1 v2 v3", 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    add_part(deck, name, part, section, card)
    first = add_nodes(deck, surface.points)
    element = deck.given["element"] + 1
    deck.given["element"] += len(surface.triangles)
    deck.keyword("ELEMENT_SHELL")
    corners = (surface.triangles + first).tolist()
    deck.rows(
        "eid:8 pid:8 n1:8 n2:8 n3:8 n4:8", ((element + k, part, a, b, c, c) for k, (a, b, c) in enumerate(corners))
    )
    return part


#: kinds of surface in *CONTACT: a set of parts, a part
PART_SET, PART = 2, 3
#: contact stiffness from nodal masses and time step, as in the contact with tools of knittest
SOFT_OPTION = 1
#: initial overlaps carry no force and are tracked
IGNORE_OPTION = 1
#: decay [ms/mm] from the static to the kinetic coefficient, complete at 0.01 mm/ms
DECAY = 500.0


class FrictionLaw(NamedTuple):
    """Static and kinetic Coulomb coefficient, and viscous damping over critical [-]."""

    static: float
    kinetic: float
    damping: float = CONTACT_DAMPING


def add_contact(
    deck: KeywordFile, kind: str, title: str, surfaces: tuple[int, int, int, int], law: FrictionLaw,
    thickness: tuple[float | None, float | None] = (None, None), ignore: int = IGNORE_OPTION,
) -> None:  # fmt: skip
    """Add contact of ``kind`` between two ``surfaces`` (their numbers, then their types) of ``thickness`` [mm]."""
    add_block(deck, f"CONTACT_{kind}_ID", "cid heading:70", deck.number_for("contact"), title.replace(",", ";")[:70])
    deck.card("surfa surfb surfatyp surfbtyp saboxid sbboxid sapr sbpr", *surfaces, 0, 0, 1, 1)
    decay = DECAY if law.static > law.kinetic else 0.0
    deck.card("fs fd dc vc vdc penchk bt dt", law.static, law.kinetic, decay, 0.0, 100.0 * law.damping, 0, 0.0, 1e20)
    deck.card("sfsa sfsb sast sbst sfsat sfsbt fsf vsf", 1.0, 1.0, *thickness, 1.0, 1.0, 1.0, 1.0)
    deck.card("soft sofscl lcidab maxpar sbopt depth bsort frcfrq", SOFT_OPTION, 0.1, 0, 1.025, 2, 2, 0, 1)
    deck.card("penmax thkopt shlthk snlog isym i2d3d sldthk sldstf", 0.0, 0, 0, 0, 0, 0, 0.0, 0.0)
    deck.card("igap ignore dprfac dtstif edgek unused flangl cid_rcf", 1, ignore, 0.0, 0.0, 0.0, None, 0.0, 0)
