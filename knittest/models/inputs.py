"""Checks of the points, cells, nodes and tables of a model."""

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from knittest.base.arrays import Array, Flags, Index
from knittest.base.errors import InputError

#: deviation of products of unit vectors from 1 and 0 that is taken for rounding
ROUNDED = 1e-9
#: area of a quadrilateral over the square of its longest side, and sine of a corner, below which it is degenerate
FLAT = 1e-6


def finite_array(values: ArrayLike, name: str, shape: tuple[int, ...] | None = None) -> Array:
    """``values`` as numbers; raises :class:`InputError` for text, NaN, infinity and, where it is given, another
    ``shape`` (-1: any length).
    """
    array = _numbers(values, name)
    if shape is not None and not (
        len(shape) == array.ndim and all(want in (-1, have) for want, have in zip(shape, array.shape, strict=True))
    ):
        wanted = ", ".join("n" if length < 0 else str(length) for length in shape)
        raise InputError(f"{name}: expected the shape ({wanted}), got {array.shape}")
    bad = np.argwhere(~np.isfinite(array))
    if len(bad) and not array.ndim:
        raise InputError(f"{name}: not finite: {float(array):g}")
    if len(bad):
        at = ", ".join(str(k) for k in bad[0])
        raise InputError(f"{name}: not finite at [{at}]: {array[tuple(bad[0])]:g}; {len(bad)} such numbers")
    return array


def _numbers(values: ArrayLike, name: str) -> Array:
    try:
        return np.asarray(values, float)
    except (TypeError, ValueError):
        raise InputError(f"{name}: expected numbers, got {_short_text(values)}") from None


def number_above(value: float, name: str, least: float = 0.0, *, equal: bool = False) -> float:
    """``value`` as a finite number; raises :class:`InputError` unless above ``least``, or ``equal`` to it."""
    number = float(finite_array(value, name, ()))
    if not (number >= least if equal else number > least):
        raise InputError(f"{name}: {number:g}; expected {'at least' if equal else 'more than'} {least:g}")
    return number


def direction(vector: ArrayLike, name: str) -> Array:
    """``vector`` (3,) as a unit vector; raises :class:`InputError` for one without length."""
    array = finite_array(vector, name, (3,))
    size = float(np.linalg.norm(array))
    if size == 0.0:
        raise InputError(f"{name}: expected a vector of nonzero length")
    return np.asarray(array / size)


def one_per_element(values: ArrayLike, name: str, count: int) -> Array:
    """``values`` (count,) or one for all, (count,); raises :class:`InputError` for others and NaN; infinity may be."""
    array = _numbers(values, name)
    if array.shape not in ((), (count,)):
        raise InputError(f"{name}: expected one number or one of each of {count} elements, got {array.shape}")
    if np.isnan(array).any():
        raise InputError(f"{name}: not a number (NaN)")
    return np.broadcast_to(array, (count,))


def tension_law(strain: ArrayLike, force: ArrayLike) -> tuple[Array, Array]:
    """Table of a section's law; raises :class:`InputError` unless it rises from (0, 0)."""
    e, f = finite_array(strain, "strain of a law", (-1,)), finite_array(force, "force of a law", (-1,))
    if len(e) != len(f) or len(e) < 2 or e[0] != 0.0 or f[0] != 0.0:
        raise InputError("law: expected at least two strains and as many forces, starting at (0, 0)")
    if (np.diff(e) <= 0.0).any() or (np.diff(f) < 0.0).any() or f[1] <= 0.0:
        raise InputError("law: expected rising strains and forces that do not fall, the second above 0")
    return e, f


def node_numbers(nodes: ArrayLike, count: int) -> Index:
    """``nodes`` as (n,) numbers; raises :class:`InputError` for one that is not in 0 to ``count`` - 1."""
    try:
        numbers = np.atleast_1d(np.asarray(nodes))
    except ValueError:  # rows of different length
        raise InputError(f"nodes: expected whole numbers, got {_short_text(nodes)}") from None
    if numbers.dtype.kind not in "iu" and numbers.size:
        raise InputError(f"nodes: expected whole numbers, got {_short_text(nodes)}")
    numbers = numbers.astype(np.int64)
    outside = numbers[(numbers < 0) | (numbers >= count)]
    if outside.size:
        raise InputError(f"nodes: {outside[0]} is not a node; expected numbers from 0 to {count - 1}")
    return numbers


def names_among(given: str | Iterable[str], known: Sequence[str], what: str) -> list[str]:
    """``given`` as a list, of one for a string; raises :class:`InputError` for a name that is not ``known``."""
    names = list(given) if isinstance(given, Iterable) and not isinstance(given, str) else [given]
    strange = [name for name in names if name not in known]
    if strange:
        raise InputError(f"{what} {strange[0]!r}: expected one of {', '.join(known)}")
    return names


def orthonormal(axes: ArrayLike) -> Array:
    """``axes`` (3, 3), rows; raises :class:`InputError` unless of length 1 and at right angles."""
    rows = finite_array(axes, "axes", (3, 3))
    if np.abs(rows @ rows.T - np.eye(3)).max() > ROUNDED:
        raise InputError(f"axes: expected three rows of length 1 at right angles, got {rows.tolist()}")
    return rows


def check_independent(node: Index, turns: Flags, axis: Array, local: Flags) -> None:
    """Raise :class:`InputError` where motions of one node, of which one is ``local``, are not at right angles.

    Of each motion (n,): its ``node``, whether it ``turns``, its unit ``axis`` (n, 3). Motions are imposed one after
    the other: a later one would undo an earlier one in part.
    """
    own = node * 2 + turns
    order = np.flatnonzero(np.isin(own, own[local]))
    order = order[np.argsort(own[order], kind="stable")]
    for apart in range(1, len(order)):  # three motions at right angles are all that a node can have
        first, second = order[:-apart], order[apart:]
        same = own[first] == own[second]
        if not same.any():
            return
        bad = np.flatnonzero(same & (np.abs(np.sum(axis[first] * axis[second], axis=1)) > ROUNDED))
        if bad.size:
            one, other = (", ".join(f"{v:.3g}" for v in axis[k[bad[0]]]) for k in (first, second))
            raise InputError(
                f"motions of node {node[first[bad[0]]]} along or about ({one}) and ({other}): expected axes at right "
                "angles on one node; where two symmetry planes meet, hold it in both directions across their line"
            )


def check_prescribed_once(node: Index, dof: Index, still: Flags, group: Index, names: Sequence[str]) -> None:
    """Raise :class:`InputError` where two motions prescribe one degree of freedom and are not both ``still``.

    Of each motion (n,): ``node``, ``dof`` among ``names``, ``group`` that it was numbered by; sorted by node and dof.
    """
    twice = (np.diff(node) == 0) & (np.diff(dof) == 0) & ~(still[1:] & still[:-1])
    for first in np.flatnonzero(twice)[:1]:
        one, other = sorted((int(group[first]), int(group[first + 1])))
        raise InputError(
            f"{names[dof[first]]} of node {node[first]} is prescribed twice, by motions {one} and {other} (numbers "
            "returned by move); give each degree of freedom one motion"
        )


def check_nodes_used(loaded: Index, cells: Index) -> None:
    """Raise :class:`InputError` for ``loaded`` nodes that belong to no element of ``cells``."""
    stray = np.setdiff1d(loaded, cells)
    if stray.size:
        raise InputError(f"load: node {stray[0]} belongs to no element ({stray.size} such nodes); load other nodes")


def chain_points(points: ArrayLike, number: int) -> Array:
    """Points (n, 3) of chain ``number``; raises :class:`InputError` for fewer than two and for two in one place."""
    array = finite_array(points, f"points of chain {number}", (-1, 3))
    if len(array) < 2:
        raise InputError(f"points of chain {number}: {len(array)} given; a chain needs at least two")
    same = np.flatnonzero(np.linalg.norm(np.diff(array, axis=0), axis=1) == 0.0)
    if same.size:
        raise InputError(f"points of chain {number}: points {same[0]} and {same[0] + 1} coincide")
    return array


def chain_fields(
    fail_strain: ArrayLike,
    slack: ArrayLike,
    degree_of_set: ArrayLike,
    loop_shortening: ArrayLike,
    count: int,
    number: int,
) -> None:
    """Check the fields of the ``count`` elements of chain ``number``; raises :class:`InputError`."""
    of = f"of chain {number}"
    if (one_per_element(fail_strain, f"fail_strain {of}", count) <= 0.0).any():
        raise InputError(f"fail_strain {of}: expected more than 0")
    if not np.isfinite(one_per_element(slack, f"slack {of}", count)).all():
        raise InputError(f"slack {of}: expected finite strains")
    share = one_per_element(degree_of_set, f"degree_of_set {of}", count)
    if ((share < 0.0) | (share > 1.0)).any():
        raise InputError(f"degree_of_set {of}: expected 0 to 1")
    share = one_per_element(loop_shortening, f"loop_shortening {of}", count)
    if ((share < 0.0) | (share >= 1.0)).any():
        raise InputError(f"loop_shortening {of}: expected 0 to below 1")


def warp_direction(warp: ArrayLike, points: Array, cells: Index) -> Array:
    """``warp`` (3,) or (n_el, 3); raises :class:`InputError` where it has no length or stands on the shell."""
    array = finite_array(warp, "warp")
    if array.shape not in ((3,), (len(cells), 3)):
        raise InputError(f"warp: expected the shape (3) or ({len(cells)}, 3), got {array.shape}")
    x = points[cells]
    normal = np.cross(x[:, 2] - x[:, 0], x[:, 3] - x[:, 1])
    rows = np.broadcast_to(array, normal.shape)
    along = np.linalg.norm(np.cross(rows, normal), axis=1) / np.linalg.norm(normal, axis=1)
    bad = np.flatnonzero(along <= FLAT * np.maximum(np.linalg.norm(rows, axis=1), 1e-300))
    if bad.size:
        raise InputError(f"warp: zero, or normal to cell {bad[0]}; expected a direction in the plane of the cell")
    return array


def chain_normals(points: ArrayLike, normal: ArrayLike | None, number: int) -> Array:
    """Unit normals (n - 1, 3) across the elements through ``points`` (n, 3) of chain ``number``.

    ``normal`` (3,) or (n - 1, 3). Raises :class:`InputError` where there is none, and where it lies along the chain.
    """
    chord = np.diff(np.asarray(points, float), axis=0)
    if normal is None:
        raise InputError(
            f"chain {number}: a section with two bending stiffnesses needs normal=, the direction about "
            "which it bends with the second"
        )
    given = finite_array(normal, f"normal of chain {number}")
    if given.shape not in ((3,), chord.shape):
        raise InputError(f"normal of chain {number}: expected the shape (3) or {chord.shape}, got {given.shape}")
    along = chord / np.linalg.norm(chord, axis=1, keepdims=True)
    across = given - np.sum(given * along, axis=1, keepdims=True) * along
    size = np.linalg.norm(across, axis=1)
    bad = np.flatnonzero(size <= FLAT * np.linalg.norm(np.broadcast_to(given, chord.shape), axis=1))
    if bad.size:
        raise InputError(f"normal of chain {number}: zero or along the chain at element {bad[0]}")
    return np.asarray(across / size[:, None])


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


def _short_text(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."
