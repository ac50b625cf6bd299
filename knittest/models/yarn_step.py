"""Bound of the highest frequency of beam chains in contact, node by node and direction by direction.

Every spring of an element or a contact stretches by a sum of w_j n . x_j over its nodes j. By Cauchy and Schwarz
x^T K x <= sum_i x_i^T B_i x_i with B_i = sum k (sum_j |w_j|) |w_i| n n^T, so omega^2 <= the largest eigenvalue of
B_i / m_i. Beams are stiff along a yarn and contacts across it, which a bound by sums of stiffnesses does not see.
Shear turns nodes too; rotary inertia is chosen so that this lowers frequencies
(:func:`knittest.kernels.beam.rotary_inertia_factor`).
"""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def nodal_loads(
    chord: Array, joined: NDArray[np.bool_], axial: Array, shear: Array, touch: Array, stick: Array
) -> Array:
    """Largest eigenvalue of B_i [N/mm], (n_nodes,); omega^2 <= load / mass.

    Element i, if ``joined``, joins nodes i and i + 1 along ``chord`` (n_nodes, 3) with stiffnesses EA / L ``axial`` and
    GA / L ``shear``; contacts add ``touch`` in any direction across the yarn and ``stick`` along it. All (n_nodes,),
    [N/mm].
    """
    length = np.linalg.norm(chord, axis=1, keepdims=True)
    along = np.where(joined[:, None], chord / np.where(joined[:, None], length, 1.0), 0.0)
    beam = 2.0 * np.where(joined, shear, 0.0)[:, None, None] * np.eye(3)
    beam = beam + 2.0 * (axial - shear)[:, None, None] * _dyad(along)
    tangent = along.copy()
    beam[1:], tangent[1:] = beam[1:] + beam[:-1], tangent[1:] + tangent[:-1]
    tangent /= np.maximum(np.linalg.norm(tangent, axis=1, keepdims=True), 1e-12)
    contact = touch[:, None, None] * np.eye(3) + (stick - touch)[:, None, None] * _dyad(tangent)
    return np.asarray(np.linalg.eigvalsh(beam + contact)[:, -1])


def _dyad(v: Array) -> Array:
    """v v^T of every row, (n, 3, 3)."""
    return v[:, :, None] * v[:, None, :]
