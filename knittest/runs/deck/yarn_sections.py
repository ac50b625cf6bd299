"""Yarns of a deck for any solver: each beam element as a resultant beam for bending and a parallel cable for tension.

Resultant beams of explicit solvers have no axial law of rising slope (slack, toe). So a beam has bending and torsion
with a small share of the axial stiffness. A cable between the same nodes carries the rest of the axial law over
engineering strain, and breaks at the failure strain.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import InputError
from knittest.models.yarn_model import YarnModel, section_of_nodes

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


class CableKind(NamedTuple):
    """Cables of one ``slack`` and failure strain ``fail`` [-], and the positions ``of`` (n,) of their elements."""

    slack: float
    fail: float
    of: Index

    @property
    def breaks(self) -> bool:
        """True if the cables fail."""
        return bool(np.isfinite(self.fail))


class YarnSection:
    """Elements of one section: their ``numbers`` in the mesh and ``length`` [mm]; resultants of beams and cables."""

    def __init__(self, model: YarnModel, section: int, numbers: Index, length: Array) -> None:
        self.model, self.section, self.numbers, self.length = model, section, numbers, length
        self.system = int(model.section_part[section])
        self.name = model.mesh.part_names[self.system]
        self.radius = float(model.mesh.radius[numbers[0]])
        self.area = np.pi * self.radius**2
        self.axial = float(np.cumsum(model.beams.hinge_slope[section]).max())  # largest tangent [N]
        nodes = np.unique(model.mesh.cells[numbers])
        self.line_mass = float(model.mass[nodes].sum() / length.sum())  # [g/mm], mass scaling included
        _, _, torsion, bending = model.beams.stiffness[section]
        #: modulus, second moment of area, torsion constant and density of the bending beams
        self.modulus = AXIAL_SHARE * self.axial / self.area
        self.second = float(bending) / self.modulus
        self.polar = float(torsion) * 2.0 * (1.0 + POISSON) / self.modulus
        self.density = MASS_SHARE * self.line_mass / self.area

    def cable_kinds(self) -> list[CableKind]:
        """Cables by their slack and failure strain."""
        beams, node = self.model.beams, self.model.element_node[self.numbers]
        kinds, which = np.unique(
            np.column_stack([beams.slack[node], beams.fail_strain[node]]), axis=0, return_inverse=True
        )
        return [
            CableKind(float(slack), float(fail), np.flatnonzero(which.ravel() == kind))
            for kind, (slack, fail) in enumerate(kinds)
        ]

    def cable_curve(self, kind: CableKind) -> tuple[Array, Array]:
        """Strain [-] and force [N] of the cables of ``kind``."""
        beams, end = self.model.beams, BEYOND * kind.fail if kind.breaks else kind.slack + UNBROKEN
        knee, slope = beams.hinge_strain[self.section], beams.hinge_slope[self.section]
        return cable_law(knee, slope, kind.slack, AXIAL_SHARE * self.axial, end)

    def cable_title(self, kind: CableKind) -> str:
        """Name of the cables of ``kind``."""
        return f"{self.name}: slack {100 * kind.slack:.4g} %, breaks at {100 * kind.fail:.4g} %"


def yarn_sections(model: YarnModel) -> list[YarnSection]:
    """Sections of the yarns of ``model``; raises :class:`InputError` for elliptic ones."""
    if np.any(model.beams.excess != 0.0) or model.group.excess.size:
        raise InputError("deck: elliptic yarn sections are not supported; leave out fabric.reinforcing.section")
    position, cells = model.position(), model.mesh.cells
    section = section_of_nodes(model.parts, model.n_nodes)[model.element_node]
    length = np.linalg.norm(position[cells[:, 1]] - position[cells[:, 0]], axis=1)
    return [
        YarnSection(model, int(number), np.flatnonzero(section == number), length[section == number])
        for number in np.unique(section)
    ]


def orientation_points(model: YarnModel) -> Array:
    """Places (3, 3) [mm], far away along x, y and z, of nodes that orient the round sections of the beams."""
    position = model.position()
    size = float(np.ptp(position, axis=0).max())
    return position.mean(axis=0) + ORIENTATION_DISTANCE * size * np.eye(3)


def orientation_nodes(model: YarnModel, cells: Index) -> Index:
    """Number, from 0 on, of the orientation node of each of ``cells`` (n, 2): that across which the beam lies."""
    position = model.position()
    across = np.argmin(np.abs(position[cells[:, 1]] - position[cells[:, 0]]), axis=1)
    return np.asarray(model.n_nodes + across)
