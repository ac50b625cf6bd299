"""Small tools of the verification cases: observed order, straight meshes, a beam of given stiffness."""

from collections.abc import Sequence

import numpy as np
from cases.row import Row

from knittest.pose import Body, Chain, section

#: a slender beam of unit length: EI / (EA L^2) = 1e-5, so that its stretch and shear take 1e-4 of a tip deflection
BEAM = {"axial": 1e5, "bending": 1.0, "radius": 0.01, "linear_density": 1e-3}


def order(errors: Sequence[float]) -> float:
    """Observed order of the last two errors of a series in which the mesh width or step halves."""
    return float(np.log2(abs(errors[-2] / errors[-1])))


def converging(case: str, source: str, quantity: str, reference: float, results: Sequence[float], mesh: str) -> Row:
    """Row of the last of ``results``, on meshes whose width halves, with their errors and order."""
    errors = [r - reference for r in results]
    scale = abs(reference) or 1.0
    series = tuple(abs(e) / scale for e in errors)
    return Row(case, source, quantity, reference, float(results[-1]), mesh, order(errors), series)


def order_without_reference(results: Sequence[float]) -> float:
    """Observed order of the last three results of such a series, from their differences."""
    return float(np.log2(abs((results[-3] - results[-2]) / (results[-2] - results[-1]))))


def line(n: int, length: float = 1.0) -> np.ndarray:
    """Points of ``n`` equal elements along x."""
    return np.column_stack([np.linspace(0.0, length, n + 1), np.zeros(n + 1), np.zeros(n + 1)])


def beam(points: np.ndarray, **changes: float) -> Body:
    """A chain through ``points`` with the section :data:`BEAM` or changes of it."""
    return Body.of_chains([Chain(points, section(**BEAM | changes))])


def settle(body: Body, tolerance: float = 1e-6) -> Body:
    """The body in its static state."""
    found = body.relax(tolerance=tolerance)
    if not found.converged:
        raise RuntimeError(f"not at rest after {found.steps} steps, residual {found.residual:.2g}")
    return body
