"""Rigid tools of a forming deck: surfaces of triangles, how each moves, and the fabric's contact with them."""

import numpy as np
from numpy.typing import NDArray

from knittest.export.keywords import KeywordFile
from knittest.kernels.tool_contact import FREE, HELD
from knittest.laboratory.forming.rig import FormingTest
from knittest.models.boundary import Boundary
from knittest.models.tool import Tool
from knittest.models.triangle_mesh import TriangleMesh
from knittest.runs.deck.motions import VELOCITY, add_curve

Array = NDArray[np.float64]

#: thickness of the tools' shells, by which a free one has its mass [mm], and that which contact sees [mm]
THICK, SEEN = 1.0, 0.01
#: steel, which stands for rigid tools: density [g/mm3], modulus [MPa], Poisson's ratio
STEEL, MODULUS, POISSON = 7.85e-3, 210e3, 0.3
#: a floor is wider than the blank by this factor
WIDER = 1.5
#: fixed degrees of freedom of *MAT_RIGID: x and y, or all three
ALONG_Z, FIXED = 4, 7
DOF_Z = 3


def surfaces(rig: FormingTest, position: Array) -> dict[str, TriangleMesh]:
    """The tools of ``rig`` by name, in the order in which its boundary numbers them, the floor last; ``position``
    (n, 3) [mm] is the blank's.
    """
    found = {name: tool.solid for name, tool in rig.tools.by_name.items()}
    if rig.floor is not None:
        (x0, y0), (x1, y1) = WIDER * position[:, :2].min(axis=0), WIDER * position[:, :2].max(axis=0)
        corners = np.array([[x, y, rig.floor] for x, y in ((x0, y0), (x1, y0), (x1, y1), (x0, y1))])
        found["floor"] = TriangleMesh(corners, np.array([[0, 1, 2], [0, 2, 3]]))
    return found


def add_tools(deck: KeywordFile, rig: FormingTest, boundary: Boundary, end: float, first_element: int) -> list[int]:
    """Add the tools with nodes and elements after those of the fabric, their motions and loads; returns their parts."""
    deck.given["element"] = first_element - 1
    section = deck.number_for("section")
    deck.keyword("SECTION_SHELL_TITLE", "tools")
    deck.card("secid elform shrf nip propt qr/irid icomp setyp", section, 2, 1.0, 2, 0, 0, 0, 1)
    deck.card("t1 t2 t3 t4 nloc marea idof edgset", THICK, THICK, THICK, THICK, 0, 0, 0, 0)
    parts = []
    named = surfaces(rig, boundary.model.position())
    for (name, surface), tool in zip(named.items(), boundary.tools, strict=True):
        parts.append(_add_tool(deck, name, surface, tool, section))
        _add_motion(deck, name, parts[-1], tool, boundary, end)
    return parts


def _add_tool(deck: KeywordFile, name: str, surface: TriangleMesh, tool: Tool, section: int) -> int:
    part, card = deck.number_for("part"), deck.number_for("material")
    free, area = tool.motion[2] != HELD, float(np.linalg.norm(surface.normals, axis=1).sum())
    density = tool.mass / (area * THICK) if tool.motion[2] == FREE else STEEL
    deck.keyword("MAT_RIGID_TITLE", name)
    deck.card("mid ro e pr n couple m alias", card, density, MODULUS, POISSON, 0.0, 0.0, 0.0, None)
    deck.card("cmo con1 con2", 1.0, ALONG_Z if free else FIXED, FIXED)
    deck.card("lco_or_a1 a2 a3 v1 v2 v3", 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    deck.keyword("PART", name)
    deck.card("pid secid mid eosid hgid grav adpopt tmid", part, section, card, 0, 0, 0, 0, 0)
    first = deck.given["node"] + 1
    deck.given["node"] += len(surface.points)
    deck.keyword("NODE")
    rows = ((first + k, *point, 0, 0) for k, point in enumerate(surface.points.tolist()))
    deck.rows("nid:8 x:16 y:16 z:16 tc:8 rc:8", rows)
    element = deck.given["element"] + 1
    deck.given["element"] += len(surface.triangles)
    deck.keyword("ELEMENT_SHELL")
    corners = (surface.triangles + first).tolist()
    deck.rows(
        "eid:8 pid:8 n1:8 n2:8 n3:8 n4:8", ((element + k, part, a, b, c, c) for k, (a, b, c) in enumerate(corners))
    )
    return part


def _add_motion(deck: KeywordFile, name: str, part: int, tool: Tool, boundary: Boundary, end: float) -> None:
    motion, load = tool.motion[2], tool.load[2]
    if motion >= 0:
        curve = add_curve(deck, f"velocity of the {name} [mm/ms] over time [ms]", boundary.tables[motion], end)
        deck.keyword("BOUNDARY_PRESCRIBED_MOTION_RIGID")
        deck.card("pid dof vad lcid sf", part, DOF_Z, VELOCITY, curve, 1.0)
    if load >= 0:
        curve = add_curve(deck, f"force on the {name} [N] over time [ms]", boundary.tables[load], end)
        deck.keyword("LOAD_RIGID_BODY")
        deck.card("pid dof lcid sf", part, DOF_Z, curve, 1.0)
