"""Signed distance from closed triangle surfaces, sampled on a regular grid."""

from math import atan2, pi, sqrt

import numpy as np
from numba import njit, prange

from knittest.kernels.options import INLINE, KERNEL, PARALLEL


@njit(**INLINE)
def _clamped(value):
    return min(max(value, 0.0), 1.0)


@njit(**INLINE)
def _dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(**INLINE)
def _less(a, b):
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@njit(**INLINE)
def _from_edge(off, edge):
    """Squared distance of the end of ``off`` from a segment ``edge``, both from the segment's start."""
    share = _clamped(_dot(off, edge) / _dot(edge, edge))
    rest = (off[0] - share * edge[0], off[1] - share * edge[1], off[2] - share * edge[2])
    return _dot(rest, rest)


@njit(**KERNEL)
def squared_distance(p, a, b, c):
    """Squared distance of point ``p`` from triangle a, b, c, three numbers each (Ericson, 2005)."""
    ab, ac, bc, ap, bp, cp = _less(b, a), _less(c, a), _less(c, b), _less(p, a), _less(p, b), _less(p, c)
    d1, d2, d3, d4, d5, d6 = _dot(ab, ap), _dot(ac, ap), _dot(ab, bp), _dot(ac, bp), _dot(ab, cp), _dot(ac, cp)
    va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
    if va > 0.0 and vb > 0.0 and vc > 0.0:
        v, w = vb / (va + vb + vc), vc / (va + vb + vc)
        off = (ap[0] - v * ab[0] - w * ac[0], ap[1] - v * ab[1] - w * ac[1], ap[2] - v * ab[2] - w * ac[2])
        return _dot(off, off)
    return min(_from_edge(ap, ab), _from_edge(ap, ac), _from_edge(bp, bc))


@njit(**KERNEL)
def solid_angle(p, a, b, c):
    """Signed solid angle of a triangle seen from ``p`` (Van Oosterom & Strackee, 1983)."""
    x, y, z = _less(a, p), _less(b, p), _less(c, p)
    lx, ly, lz = sqrt(_dot(x, x)), sqrt(_dot(y, y)), sqrt(_dot(z, z))
    turned = (y[1] * z[2] - y[2] * z[1], y[2] * z[0] - y[0] * z[2], y[0] * z[1] - y[1] * z[0])
    return 2.0 * atan2(_dot(x, turned), lx * ly * lz + _dot(x, y) * lz + _dot(y, z) * lx + _dot(z, x) * ly)


@njit(**PARALLEL)
def sample_distance(corners, origin, spacing, samples):
    """Fill ``samples`` (nx, ny, nz) with the signed distance [mm], negative inside.

    ``corners`` (n, 3, 3) [mm] of a closed surface whose triangles turn left seen from outside.
    """
    nx, ny, nz = samples.shape
    for flat in prange(nx * ny):
        i, j = flat // ny, flat % ny
        for k in range(nz):
            p = (origin[0] + i * spacing, origin[1] + j * spacing, origin[2] + k * spacing)
            nearest, angle = np.inf, 0.0
            for t in range(corners.shape[0]):
                a = (corners[t, 0, 0], corners[t, 0, 1], corners[t, 0, 2])
                b = (corners[t, 1, 0], corners[t, 1, 1], corners[t, 1, 2])
                c = (corners[t, 2, 0], corners[t, 2, 1], corners[t, 2, 2])
                nearest = min(nearest, squared_distance(p, a, b, c))
                angle += solid_angle(p, a, b, c)
            samples[i, j, k] = -sqrt(nearest) if angle > 2.0 * pi else sqrt(nearest)
