"""Distance from triangle surfaces and crossings with them, sampled on a regular grid."""

import numpy as np
from numba import njit, prange

from knittest.kernels.vec import INLINE, PARALLEL, PART

#: without fast math: the two triangles at an edge must decide by the same bits
EXACT = {key: value for key, value in INLINE.items() if key != "fastmath"}
#: slices of a grid that threads work on
SLABS = 32


@njit(**INLINE)
def _clamp_unit(value):
    return min(max(value, 0.0), 1.0)


@njit(**INLINE)
def _dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(**INLINE)
def _difference(a, b):
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@njit(**INLINE)
def _from_edge(off, edge):
    """Squared distance of the end of ``off`` from a segment ``edge``, both from the segment's start."""
    share = _clamp_unit(_dot(off, edge) / _dot(edge, edge))
    rest = (off[0] - share * edge[0], off[1] - share * edge[1], off[2] - share * edge[2])
    return _dot(rest, rest)


@njit(**PART)
def squared_distance(p, a, b, c):
    """Squared distance of point ``p`` from triangle a, b, c, three numbers each (Ericson, 2005)."""
    ab, ac, bc, ap, bp, cp = (
        _difference(b, a),
        _difference(c, a),
        _difference(c, b),
        _difference(p, a),
        _difference(p, b),
        _difference(p, c),
    )
    d1, d2, d3, d4, d5, d6 = _dot(ab, ap), _dot(ac, ap), _dot(ab, bp), _dot(ac, bp), _dot(ab, cp), _dot(ac, cp)
    va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
    if va > 0.0 and vb > 0.0 and vc > 0.0:
        v, w = vb / (va + vb + vc), vc / (va + vb + vc)
        off = (ap[0] - v * ab[0] - w * ac[0], ap[1] - v * ab[1] - w * ac[1], ap[2] - v * ab[2] - w * ac[2])
        return _dot(off, off)
    return min(_from_edge(ap, ab), _from_edge(ap, ac), _from_edge(bp, bc))


@njit(**PARALLEL)
def near_distance(corners, origin, spacing, band, square, nearest):
    """Lower ``square`` (nx, ny, nz) to the squared distance [mm2] from triangles within ``band`` [mm] of a sample.

    ``corners`` (n, 3, 3) [mm]; ``nearest`` (nx, ny, nz) receives the number of the nearest triangle. Samples farther
    off keep what they hold. Every triangle looks only at the samples in the box round it.
    """
    nx, ny, nz = square.shape
    slabs = min(SLABS, nx)
    for slab in prange(slabs):
        first, last = slab * nx // slabs, (slab + 1) * nx // slabs
        for t in range(corners.shape[0]):
            i0, i1 = _samples_within_band(corners[t, :, 0], origin[0], spacing, band, first, last)
            j0, j1 = _samples_within_band(corners[t, :, 1], origin[1], spacing, band, 0, ny)
            k0, k1 = _samples_within_band(corners[t, :, 2], origin[2], spacing, band, 0, nz)
            if i0 >= i1 or j0 >= j1 or k0 >= k1:
                continue
            a, b, c = _corners(corners, t)
            for i in range(i0, i1):
                for j in range(j0, j1):
                    for k in range(k0, k1):
                        d2 = squared_distance(_place(origin, spacing, i, j, k), a, b, c)
                        if d2 < square[i, j, k] and d2 < band * band:
                            square[i, j, k], nearest[i, j, k] = d2, t


@njit(**PARALLEL)
def inherit(source, beyond, nearest):
    """Give every sample ``beyond`` (nx, ny, nz) the ``nearest`` triangle of the sample ``source`` (3, nx, ny, nz)."""
    for i in prange(nearest.shape[0]):
        for j in range(nearest.shape[1]):
            for k in range(nearest.shape[2]):
                if beyond[i, j, k]:
                    nearest[i, j, k] = nearest[source[0, i, j, k], source[1, i, j, k], source[2, i, j, k]]


@njit(**PARALLEL)
def far_distance(corners, origin, spacing, beyond, nearest, square, found):
    """Set ``square`` [mm2] of the samples ``beyond`` (nx, ny, nz) to that from the ``nearest`` triangle of them and of
    their six neighbours; ``found`` (nx, ny, nz) receives the number of the nearest of these.
    """
    for i in prange(beyond.shape[0]):
        for j in range(beyond.shape[1]):
            for k in range(beyond.shape[2]):
                found[i, j, k] = nearest[i, j, k]
                if beyond[i, j, k]:
                    square[i, j, k], found[i, j, k] = _nearest_of_neighbours(corners, origin, spacing, nearest, i, j, k)


@njit(**PART)
def _nearest_of_neighbours(corners, origin, spacing, nearest, i, j, k):
    """Squared distance [mm2] and number of the nearest of the triangles of a sample and its neighbours."""
    place, found = _place(origin, spacing, i, j, k), nearest[i, j, k]
    a, b, c = _corners(corners, found)
    least = squared_distance(place, a, b, c)
    for side in range(6):
        step = 1 if side % 2 else -1
        u, v, w = i + (side // 2 == 0) * step, j + (side // 2 == 1) * step, k + (side // 2 == 2) * step
        if not (0 <= u < nearest.shape[0] and 0 <= v < nearest.shape[1] and 0 <= w < nearest.shape[2]):
            continue
        other = nearest[u, v, w]
        if other != found:
            a, b, c = _corners(corners, other)
            d2 = squared_distance(place, a, b, c)
            if d2 < least:
                least, found = d2, other
    return least, found


@njit(**PARALLEL)
def crossings(corners, origin, spacing, steps):
    """Add to ``steps`` (nx, ny, nz) what the surface turns at the first sample above each of its points over a column.

    +1 where a column enters the body from below, -1 where it leaves it: sums along z are 1 inside. A column through an
    edge or corner crosses exactly one of the triangles there on either side, because all of them treat an edge in the
    same direction.
    """
    nx, ny, nz = steps.shape
    slabs = min(SLABS, nx)
    for slab in prange(slabs):
        first, last = slab * nx // slabs, (slab + 1) * nx // slabs
        for t in range(corners.shape[0]):
            i0, i1 = _samples_within_band(corners[t, :, 0], origin[0], spacing, 0.0, first, last)
            j0, j1 = _samples_within_band(corners[t, :, 1], origin[1], spacing, 0.0, 0, ny)
            a, b, c = _corners(corners, t)
            normal = _normal(a, b, c)
            if normal[2] == 0.0:
                continue
            up = normal[2] > 0.0
            for i in range(i0, i1):
                for j in range(j0, j1):
                    x, y = origin[0] + i * spacing, origin[1] + j * spacing
                    if _is_left(a, b, x, y) == up and _is_left(b, c, x, y) == up and _is_left(c, a, x, y) == up:
                        z = a[2] - (normal[0] * (x - a[0]) + normal[1] * (y - a[1])) / normal[2]
                        z = min(max(z, min(a[2], b[2], c[2])), max(a[2], b[2], c[2]))  # of a steep triangle
                        k = max(int(np.ceil((z - origin[2]) / spacing)), 0)
                        if k < nz:
                            steps[i, j, k] += -1 if up else 1


@njit(**EXACT)
def _is_left(a, b, x, y):
    """Return whether (x, y) is on the left of the line from ``a`` to ``b`` seen from above; the reverse from b to a."""
    turned = b[0] < a[0] or (b[0] == a[0] and b[1] < a[1])
    if turned:
        a, b = b, a
    return ((b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0]) >= 0.0) != turned


@njit(**INLINE)
def _samples_within_band(values, origin, spacing, band, first, last):
    """Range of samples within ``band`` of three ``values`` along an axis, in first..last."""
    low, high = min(values[0], values[1], values[2]) - band, max(values[0], values[1], values[2]) + band
    begin, end = np.ceil((low - origin) / spacing), np.floor((high - origin) / spacing) + 1.0
    return int(min(max(begin, first), last)), int(max(min(end, last), first))


@njit(**INLINE)
def _corners(corners, t):
    return (
        (corners[t, 0, 0], corners[t, 0, 1], corners[t, 0, 2]),
        (corners[t, 1, 0], corners[t, 1, 1], corners[t, 1, 2]),
        (corners[t, 2, 0], corners[t, 2, 1], corners[t, 2, 2]),
    )


@njit(**INLINE)
def _place(origin, spacing, i, j, k):
    return origin[0] + i * spacing, origin[1] + j * spacing, origin[2] + k * spacing


@njit(**INLINE)
def _normal(a, b, c):
    p, q = _difference(b, a), _difference(c, a)
    return p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]
