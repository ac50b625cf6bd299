"""Contacts and nodes for kernels that are called one by one, and differences of their energies."""

from collections.abc import Callable
from typing import Any

import numpy as np

from knittest.kernels.state import Contacts, Nodes

VECTORS = ("spring", "offset", "force", "tangent", "other_tangent")
NUMBERS = ("slipping", "reach", "line", "twist", "couple", "accepted")


def contacts_of(*pieces: tuple[int, int], **given: Any) -> Contacts:
    """Contacts at the middles of pairs of ``pieces``, free of force; ``given`` are other fields."""
    n = len(pieces)
    fields = {name: np.zeros((3, n)) for name in VECTORS} | {name: np.zeros(n) for name in NUMBERS}
    fields |= {
        "piece": np.array(pieces).T.copy(), "parameter": np.full((2, n), 0.5), "arm": np.full(n, 0.5),
        "lever": np.zeros((2, n)), "half": np.arange(2 * n), "half_start": np.array([0, 2 * n]), "share": np.ones(n),
    }  # fmt: skip
    return Contacts(**fields | given)


def nodes_at(position: np.ndarray) -> Nodes:
    """Nodes of unit mass and inertia at rest at ``position`` (3, n)."""
    n, rotation = position.shape[1], np.zeros((4, position.shape[1]))
    rotation[0] = 1.0
    return Nodes(position, rotation, *(np.zeros((3, n)) for _ in range(4)), *np.ones((3, n)))


def derivative(energy: Callable[[], float], array: np.ndarray, at: tuple[int, ...], h: float) -> float:
    """Derivative of ``energy`` by the entry ``at`` of ``array``, by central differences."""
    start, found = array[at], []
    for step in (h, -h):
        array[at] = start + step
        found.append(energy())
    array[at] = start
    return (found[0] - found[1]) / (2.0 * h)
