"""Refuses points, cells, nodes and tables that no model can be made of, each with one message."""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from knittest.base.errors import InputError

Array = NDArray[np.float64]
Index = NDArray[np.int64]

#: area of a quadrilateral over the square of its longest side, and sine of a corner, below which it is degenerate
FLAT = 1e-6


def finite(values: ArrayLike, name: str, shape: tuple[int, ...] | None = None) -> Array:
    """``values`` as numbers; raises :class:`InputError` for text, NaN, infinity and, where it is given, another
    ``shape`` (-1: any length).
    """
    try:
        array = np.asarray(values, float)
    except (TypeError, ValueError):
        raise InputError(f"{name}: expected numbers, got {_short(values)}") from None
    fits = shape is None or (
        len(shape) == array.ndim and all(want in (-1, have) for want, have in zip(shape, array.shape, strict=True))
    )
    if not fits:
        wanted = ", ".join("n" if length < 0 else str(length) for length in shape or ())
        raise InputError(f"{name}: expected the shape ({wanted}), got {array.shape}")
    bad = np.argwhere(~np.isfinite(array))
    if len(bad):
        at = ", ".join(str(k) for k in bad[0])
        raise InputError(f"{name}: not finite at [{at}]: {array[tuple(bad[0])]:g}; {len(bad)} such numbers")
    return array


def node_numbers(nodes: ArrayLike, count: int) -> Index:
    """``nodes`` as (n,) numbers; raises :class:`InputError` for one that is not in 0 to ``count`` - 1."""
    numbers = np.atleast_1d(np.asarray(nodes))
    if numbers.dtype.kind not in "iu" and numbers.size:
        raise InputError(f"nodes: expected whole numbers, got {_short(nodes)}")
    numbers = numbers.astype(np.int64)
    outside = numbers[(numbers < 0) | (numbers >= count)]
    if outside.size:
        raise InputError(f"nodes: {outside[0]} is not a node; expected numbers from 0 to {count - 1}")
    return numbers


def names_among(given: str | Iterable[str], known: Sequence[str], what: str) -> list[str]:
    """``given`` as a list, of one for a string; raises :class:`InputError` for a name that is not ``known``."""
    names = [given] if isinstance(given, str) else list(given)
    strange = [name for name in names if name not in known]
    if strange:
        raise InputError(f"{what} {strange[0]!r}: expected one of {', '.join(known)}")
    return names


def chain_points(points: ArrayLike, number: int) -> Array:
    """Points (n, 3) of chain ``number``; raises :class:`InputError` for fewer than two and for two in one place."""
    array = finite(points, f"points of chain {number}", (-1, 3))
    if len(array) < 2:
        raise InputError(f"points of chain {number}: {len(array)} given; a chain needs at least two")
    same = np.flatnonzero(np.linalg.norm(np.diff(array, axis=0), axis=1) == 0.0)
    if same.size:
        raise InputError(f"points of chain {number}: points {same[0]} and {same[0] + 1} lie in one place")
    return array


def quadrilaterals(points: Array, cells: ArrayLike) -> Index:
    """Cells (n_el, 4) on ``points`` (n, 3); raises :class:`InputError` for nodes that do not exist and for
    quadrilaterals that are collapsed, folded over or not convex.
    """
    conn = np.asarray(cells)
    if conn.ndim != 2 or conn.shape[1] != 4 or not len(conn):
        raise InputError(f"cells: expected the shape (n, 4), got {conn.shape}")
    conn = node_numbers(conn.ravel(), len(points)).reshape(-1, 4)
    x = points[conn]
    side = np.roll(x, -1, axis=1) - x
    longest = np.linalg.norm(side, axis=2).max(axis=1)
    normal = np.cross(x[:, 2] - x[:, 0], x[:, 3] - x[:, 1])
    area = 0.5 * np.linalg.norm(normal, axis=1)
    corner = np.cross(np.roll(side, 1, axis=1), side)  # twice the area at each corner, along the normal where convex
    along = np.einsum("ekd,ed->ek", corner, normal / np.maximum(2.0 * area, 1e-300)[:, None])
    bad = np.flatnonzero((area <= FLAT * longest**2) | (along <= FLAT * longest[:, None] ** 2).any(axis=1))
    if bad.size:
        raise InputError(
            f"cells: cell {bad[0]} (nodes {', '.join(map(str, conn[bad[0]]))}) is collapsed, folded over or not "
            "convex; expected corners in order around a convex quadrilateral"
        )
    return conn


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."
