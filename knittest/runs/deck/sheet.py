"""Sheet of a deck: fully integrated shells of three layers, each with two families of fibres.

*MAT_REINFORCED_THERMOPLASTIC (249) has what the laboratory's shells have: fibres along warp and weft that turn with
the fabric, a curve of stress over strain for each, and one of shear over the angle between them. Its layers lie where
the laminate's do (*INTEGRATION_SHELL), so that tension and bending stay apart.
"""

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import InputError
from knittest.export.keywords import KeywordFile
from knittest.kernels.shell_state import BLOCK, FIBRE_X, STATE_ROWS, Laminate
from knittest.models.fabric_model import FabricModel

Array = NDArray[np.float64]

#: layers, each a third of the section: outer, middle, outer
LAYERS = 3
#: the matrix that the material asks for: its modulus over the smallest shear modulus of the fibres
MATRIX_SHARE = 1e-2
#: yield stress over the modulus of the matrix: it never yields
ELASTIC = 1e6
#: largest compression of fibres, strain beyond the law's last knee, and largest shear angle [rad] of the curves
COMPRESSED, BEYOND, SHEARED = -0.5, 0.5, 1.5
#: part of a direction that counts as none, and by which one shell's may differ from the others': blanks are uneven
LEVEL, UNEVEN = 1e-3, 0.1


def warp_direction(model: FabricModel) -> Array:
    """Warp of all shells, (3,); raises :class:`InputError` where it differs between them."""
    element = np.arange(len(model.mesh.cells))
    at = (element // BLOCK) * STATE_ROWS * BLOCK + element % BLOCK
    warp = np.column_stack([model.shells.state[at + int(FIBRE_X) + k * BLOCK] for k in range(3)])
    mean: Array = warp.mean(axis=0)
    mean[np.abs(mean) < LEVEL] = 0.0
    if np.abs(warp - mean).max() > UNEVEN:
        raise InputError("deck: the warp of the shells differs from place to place; expected one direction")
    return mean / np.linalg.norm(mean)


def fibre_curves(card: Laminate, direction: int) -> list[tuple[Array, Array]]:
    """Strain [-] and force per width [N/mm] of an outer layer and of the middle one along ``direction``."""
    knee, slope = card.knee[direction], card.slope[direction]
    strain = np.unique(np.concatenate([[COMPRESSED, 0.0], knee, [knee.max() + BEYOND]]))
    middle = card.compression[direction] * np.minimum(strain, 0.0)
    middle += (slope * np.maximum(strain[:, None] - knee, 0.0)).sum(axis=1)
    return [(strain, card.outer[direction] * strain), (strain, middle)]


def shear_curve(card: Laminate) -> tuple[Array, Array]:
    """Shear angle [rad] and force [N/mm] per width conjugate to it, for both senses."""
    half = np.unique(np.concatenate([[0.0], card.shear_knee, [SHEARED]]))
    half = half[half <= SHEARED]
    force = (card.shear_slope * np.maximum(half[:, None] - card.shear_knee, 0.0)).sum(axis=1)
    return np.concatenate([-half[:0:-1], half]), np.concatenate([-force[:0:-1], force])


def add_sheet(deck: KeywordFile, model: FabricModel) -> int:
    """Add nodes, shells, section, layers and their materials; returns the number of the fabric's part."""
    position, card = model.position(), model.laminate
    deck.given["node"] = len(position)
    deck.keyword("NODE")
    deck.rows("nid:8 x:16 y:16 z:16 tc:8 rc:8", ((n, *point, 0, 0) for n, point in enumerate(position.tolist(), 1)))
    thick = 2.0 * card.layer_offset
    density = float(model.mass.sum()) / (_area(model) * thick)
    materials, section = _materials(deck, model, thick, density), deck.number_for("section")
    fabric, plies = deck.number_for("part"), [deck.number_for("part") for _ in range(2)]
    deck.keyword("INTEGRATION_SHELL")
    deck.card("irid nip esop failopt", 1, LAYERS, 0, 0)
    share = 1.0 / LAYERS
    deck.rows("s wf pid", [(-1.0, share, plies[0]), (0.0, share, plies[1]), (1.0, share, plies[0])])
    deck.keyword("SECTION_SHELL_TITLE", "fabric: layers at the laminate's offset, not at the fabric's faces")
    deck.card("secid elform shrf nip propt qr/irid icomp setyp", section, 16, 1.0, LAYERS, 0, -1, 0, 1)
    deck.card("t1 t2 t3 t4 nloc marea idof edgset", thick, thick, thick, thick, 0, 0, 0, 0)
    surface = 2.0 * float(model.mesh.radius[0])
    deck.keyword("PART_CONTACT", "fabric")
    deck.card("pid secid mid eosid hgid grav adpopt tmid", fabric, section, materials[1], 0, 0, 0, 0, 0)
    deck.card("fs fd dc vc optt sft ssf cparm8", None, None, None, None, surface, 1.0, 1.0, None)
    for ply, material, name in zip(plies, materials, ("outer layers", "middle layer"), strict=True):
        deck.keyword("PART", f"{name}, without elements")
        deck.card("pid secid mid eosid hgid grav adpopt tmid", ply, section, material, 0, 0, 0, 0, 0)
    deck.keyword("ELEMENT_SHELL")
    cells = (model.mesh.cells + 1).tolist()
    deck.rows("eid:8 pid:8 n1:8 n2:8 n3:8 n4:8", ((e, fabric, *corners) for e, corners in enumerate(cells, 1)))
    return fabric


def _area(model: FabricModel) -> float:
    a, b, c, d = np.moveaxis(model.position()[model.mesh.cells], 1, 0)
    return float(0.5 * np.linalg.norm(np.cross(c - a, d - b), axis=1).sum())


def _materials(deck: KeywordFile, model: FabricModel, thick: float, density: float) -> list[int]:
    """Add the materials of the outer layers and of the middle one; returns their numbers."""
    card, ply = model.laminate, thick / LAYERS
    angle, force = shear_curve(card)
    shear = deck.curve("fabric: shear stress [MPa] over the shear angle [rad]", angle, force / thick)
    softest = float((force[angle > 0.0] / angle[angle > 0.0]).min()) / thick
    matrix = MATRIX_SHARE * softest
    hardening = deck.curve("matrix: it never yields", [0.0, 1.0], [ELASTIC * matrix, ELASTIC * matrix])
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
        warp = warp_direction(model)
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
