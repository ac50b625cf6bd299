"""Elastic energy of beams by mechanism: stretching, bending, torsion."""

import numpy as np
from numpy.typing import NDArray

from knittest.kernels.beam import axial_strain, mean_frame
from knittest.models.yarn_model import YarnModel

Array = NDArray[np.float64]

MECHANISMS = ("stretching", "bending", "torsion")


def beam_energies(model: YarnModel) -> dict[str, Array]:
    """Energies [mJ] of the living beams of each part, (n_parts,), by :data:`MECHANISMS`.

    That of transverse shear, which bending needs, is with bending. Together they are those of ``model.stored()``.
    """
    nodes, beams, i = model.nodes, model.beams, model.element_node
    section = np.zeros(model.n_nodes, np.int64)
    for first, stop, number in model.parts.span:
        section[first:stop] = number
    section = section[i]
    q1, q2 = nodes.rotation[:, i], nodes.rotation[:, i + 1]
    ax, ay, az, cx, cy, cz, _ = mean_frame.py_func(*q1, *q2, *beams.tangent[:, i])
    axis, turn = np.array([ax, ay, az]), np.array([cx, cy, cz])
    normal = np.array(mean_frame.py_func(*q1, *q2, *beams.normal[:, i])[:3])
    chord, inv_length = nodes.position[:, i + 1] - nodes.position[:, i], beams.inv_length[i]
    compression, shear, torsion, bending = beams.stiffness[section].T
    strain = axial_strain.py_func(*axis, *chord, inv_length)
    stretching = 0.5 * compression * np.minimum(strain, 0.0) ** 2
    for knee, slope in zip(beams.hinge_strain[section].T, beams.hinge_slope[section].T, strict=True):
        stretching = stretching + 0.5 * slope * np.maximum(strain - beams.slack[i] - knee, 0.0) ** 2
    across = np.sum((chord * inv_length) ** 2, axis=0) - (strain + 1.0) ** 2
    twist2, turn2 = np.sum(turn * axis, axis=0) ** 2, np.sum(turn**2, axis=0)
    flat = beams.excess[section] * np.sum(turn * normal, axis=0) ** 2
    found = {
        "stretching": stretching / inv_length,
        "bending": 0.5 * (shear * across / inv_length + (bending * (turn2 - twist2) + flat) * inv_length),
        "torsion": 0.5 * torsion * twist2 * inv_length,
    }
    alive, part = beams.alive[i], model.mesh.part
    return {
        name: np.bincount(part, alive * energy, len(model.mesh.part_names)).astype(float)
        for name, energy in found.items()
    }
