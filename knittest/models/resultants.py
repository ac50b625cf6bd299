"""Forces and moments that sections and contacts carry, by element and by node, for problems posed by hand."""

import numpy as np
from numpy.typing import NDArray

from knittest.kernels.beam import axial_strain, flat_moment, mean_frame, section_force, section_moment
from knittest.kernels.state import Beams, Nodes

Array = NDArray[np.float64]
Index = NDArray[np.int64]


def beam_resultants(nodes: Nodes, beams: Beams, element: Index, section: Index) -> dict[str, Array]:
    """Force [N] and moment [N mm] in the middle of each beam, (n_el, 3) in global axes, 0 where it is broken.

    ``element`` (n_el,) first node of each, ``section`` (n_el,) its card. They are what the side of the second node
    exerts on that of the first. ``axial_force``, ``shear_force`` [N], ``torsion`` and ``bending`` [N mm], (n_el,), are
    the parts along the axis and the sizes of those across it; ``bending_normal`` is the part about the normal of a flat
    section.
    """
    i, j = element, element + 1
    ax, ay, az, cx, cy, cz, inv = mean_frame.py_func(*nodes.rotation[:, i], *nodes.rotation[:, j], *beams.tangent[:, i])
    axis, turn = np.array([ax, ay, az]), np.array([cx, cy, cz])
    chord, inv_length = nodes.position[:, j] - nodes.position[:, i], beams.inv_length[i]
    compression, shear, torsion, bending = beams.stiffness[section].T
    strain = axial_strain.py_func(*axis, *chord, inv_length)
    axial = compression * np.minimum(strain, 0.0)
    for knee, slope in zip(beams.hinge_strain[section].T, beams.hinge_slope[section].T, strict=True):
        axial = axial + slope * np.maximum(strain - beams.slack[i] - knee, 0.0)
    force = np.array(section_force.py_func(axial, strain, shear, *axis, *chord, inv_length))
    couple = np.cross(chord, force, axis=0)
    moment = np.array(section_moment.py_func(torsion, bending, inv, inv_length, *axis, *turn, *couple))
    normal = np.array(mean_frame.py_func(*nodes.rotation[:, i], *nodes.rotation[:, j], *beams.normal[:, i])[:3])
    moment += np.array(flat_moment.py_func(beams.excess[section], inv, inv_length, *normal, *turn))
    force, moment = beams.alive[i] * force, beams.alive[i] * moment
    along, about = np.sum(force * axis, axis=0), np.sum(moment * axis, axis=0)
    return {
        "force": force.T, "moment": moment.T, "axial_force": along, "torsion": about,
        "shear_force": np.linalg.norm(force - along * axis, axis=0),
        "bending": np.linalg.norm(moment - about * axis, axis=0), "bending_normal": np.sum(moment * normal, axis=0),
    }  # fmt: skip
