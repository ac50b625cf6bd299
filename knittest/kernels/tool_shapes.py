"""Signed distance of a point from a tool, in the tool's own axes; a new shape is one more function here."""

from math import sqrt

import numpy as np
from numba import njit

from knittest.kernels.state import CYLINDER, GRID, PLANE, PLATE, SWEPT
from knittest.kernels.vec import INLINE, KERNEL, PART, U

#: distance [mm] returned where a sampled shape knows nothing
FAR = 1e9


@njit(**INLINE)
def plate_distance(x, y, z, a, b, c, r):
    """Box of half lengths a, b, c with edges rounded by r; distance and outward normal."""
    qx, qy, qz = abs(x) - a + r, abs(y) - b + r, abs(z) - c + r
    px, py, pz = max(qx, 0.0), max(qy, 0.0), max(qz, 0.0)
    out = sqrt(px * px + py * py + pz * pz)
    if out > 0.0:
        nx, ny, nz = px / out, py / out, pz / out
        d = out - r
    elif qx > qy and qx > qz:
        nx, ny, nz, d = 1.0, 0.0, 0.0, qx - r
    elif qy > qz:
        nx, ny, nz, d = 0.0, 1.0, 0.0, qy - r
    else:
        nx, ny, nz, d = 0.0, 0.0, 1.0, qz - r
    return d, nx * (1.0 if x >= 0.0 else -1.0), ny * (1.0 if y >= 0.0 else -1.0), nz * (1.0 if z >= 0.0 else -1.0)


@njit(**INLINE)
def cylinder_distance(x, y, z, radius, half):
    """Cylinder along z, without caps: beyond its ends nothing touches."""
    rho = sqrt(x * x + y * y)
    if abs(z) > half or rho == 0.0:
        return FAR, 1.0, 0.0, 0.0
    return rho - radius, x / rho, y / rho, 0.0


@njit(**PART)
def grid_distance(x, y, z, spacing, grid, samples):
    """Trilinear interpolation of a sampled signed distance and its gradient; first sample at the local origin."""
    nx, ny, nz = grid[1], grid[2], grid[3]
    u, v, w = x / spacing, y / spacing, z / spacing
    if not (0.0 <= u < nx - 1 and 0.0 <= v < ny - 1 and 0.0 <= w < nz - 1):
        return FAR, 0.0, 0.0, 1.0
    i, j, k = int(u), int(v), int(w)
    u, v, w = u - i, v - j, w - k
    at = grid[0] + (i * ny + j) * nz + k
    c000, c001, c010, c011 = samples[at], samples[at + 1], samples[at + nz], samples[at + nz + 1]
    at += ny * nz
    c100, c101, c110, c111 = samples[at], samples[at + 1], samples[at + nz], samples[at + nz + 1]
    x00, x01, x10, x11 = (
        c000 + u * (c100 - c000), c001 + u * (c101 - c001), c010 + u * (c110 - c010), c011 + u * (c111 - c011),
    )  # fmt: skip
    y0, y1 = x00 + v * (x10 - x00), x01 + v * (x11 - x01)
    gx0 = (c100 - c000) + v * ((c110 - c010) - (c100 - c000))
    gx1 = (c101 - c001) + v * ((c111 - c011) - (c101 - c001))
    gx, gy, gz = gx0 + w * (gx1 - gx0), (x10 - x00) + w * ((x11 - x01) - (x10 - x00)), y1 - y0
    return y0 + w * (y1 - y0), gx / spacing, gy / spacing, gz / spacing


@njit(**PART)
def plan_distance(x, y, spacing, grid, samples):
    """Bilinear interpolation of a signed distance in plan and its gradient; first sample at the local origin.

    Beyond the grid it goes on from the nearest sample with the distance from that.
    """
    nx, ny = grid[1], grid[2]
    # where the grid ends, and not by rounding: a point inside would get the direction of nothing
    last_x, last_y = (nx - 1) * spacing, (ny - 1) * spacing
    inside_x, inside_y = min(max(x, 0.0), last_x), min(max(y, 0.0), last_y)
    beyond_x, beyond_y = x - inside_x, y - inside_y
    u, v = inside_x / spacing, inside_y / spacing
    i, j = min(int(u), nx - 2), min(int(v), ny - 2)
    u, v = u - i, v - j
    at = grid[0] + i * ny + j
    c00, c01, c10, c11 = samples[at], samples[at + 1], samples[at + ny], samples[at + ny + 1]
    y0, y1 = c00 + u * (c10 - c00), c01 + u * (c11 - c01)
    d = y0 + v * (y1 - y0)
    beyond = sqrt(beyond_x * beyond_x + beyond_y * beyond_y)
    if beyond > 0.0:
        side = 1.0 if d >= 0.0 else -1.0
        return d + side * beyond, side * beyond_x / beyond, side * beyond_y / beyond
    gx = (c10 - c00) + v * ((c11 - c01) - (c10 - c00))
    return d, gx / spacing, (y1 - y0) / spacing


@njit(**INLINE)
def edge_distance(s, z, radius, sine, cosine):
    """A body below z = 0 that ends at s = 0 with a wall that leans outwards below; its edge is rounded by ``radius``.

    ``s`` is the distance in plan from the sharp edge; ``sine`` and ``cosine`` are of the draft. Distance and outward
    normal along s and z.
    """
    a, b = s + radius * (1.0 - sine) / cosine, z + radius
    if a > 0.0 and a * sine < b * cosine:
        off = sqrt(a * a + b * b)
        if off > 0.0:
            return off - radius, a / off, b / off
    wall = s * cosine + z * sine
    if wall > z:
        return wall, cosine, sine
    return z, 0.0, 1.0


@njit(**KERNEL)
def edge_distances(s, z, radius, sine, cosine, out):
    """Fill ``out`` (n,) with the :func:`edge_distance` of ``s`` and ``z`` (n,)."""
    for k in range(s.size):
        out[k] = edge_distance(s[k], z[k], radius, sine, cosine)[0]


@njit(**INLINE)
def tool_frame(t, tools):
    """Position (3), axes (9), size (4) and plan (5) of tool ``t`` as scalars, read once and not for every node."""
    p, a, s, b = tools.position[t], tools.axes[t], tools.size[t], tools.plan[t]
    return (
        p[0], p[1], p[2], a[0, 0], a[0, 1], a[0, 2], a[1, 0], a[1, 1], a[1, 2], a[2, 0], a[2, 1], a[2, 2],
        s[0], s[1], s[2], s[3], b[0], b[1], b[2], b[3], b[4],
    )  # fmt: skip


@njit(**INLINE)
def swept_distance(x, y, z, size, plan, grid, samples):
    """Distance from a swept edge of ``size`` and ``plan`` and its gradient."""
    spacing, radius, sine, cosine = size
    centre_x, centre_y, half_x, half_y, goes_on = plan
    off = max(abs(x - centre_x) - half_x, abs(y - centre_y) - half_y)
    if off > 0.0 and goes_on > 0.0 and z > -radius:
        return z, 0.0, 0.0, 1.0
    s, gx, gy = plan_distance(x, y, spacing, grid, samples)
    d, across, nz = edge_distance(s, z, radius, sine, cosine)
    return d, across * gx, across * gy, nz


@njit(**INLINE)
def frame_distance(kind, frame, grid, samples, x, y, z):
    """Signed distance [mm] of a point from a tool of ``kind`` at ``frame`` and the outward normal, in global axes.

    ``grid`` and ``samples`` describe a sampled shape. The normal is the gradient of the distance; of a sampled shape it
    is not quite of unit length, which keeps the contact force the gradient of an energy.
    """
    ox, oy, oz, ax, ay, az, bx, by, bz, cx, cy, cz, s0, s1, s2, s3, p0, p1, p2, p3, p4 = frame
    px, py, pz = x - ox, y - oy, z - oz
    lx, ly, lz = ax * px + ay * py + az * pz, bx * px + by * py + bz * pz, cx * px + cy * py + cz * pz
    d, nx, ny, nz = FAR, 0.0, 0.0, 1.0
    if kind == PLANE:
        d = lz
    elif kind == PLATE:
        d, nx, ny, nz = plate_distance(lx, ly, lz, s0, s1, s2, s3)
    elif kind == CYLINDER:
        d, nx, ny, nz = cylinder_distance(lx, ly, lz, s0, s1)
    elif kind == GRID:
        d, nx, ny, nz = grid_distance(lx, ly, lz, s0, grid, samples)
    elif kind == SWEPT:
        size, plan = (s0, s1, s2, s3), (p0, p1, p2, p3, p4)
        d, nx, ny, nz = swept_distance(lx, ly, lz, size, plan, grid, samples)
    return d, nx * ax + ny * bx + nz * cx, nx * ay + ny * by + nz * cy, nx * az + ny * bz + nz * cz


@njit(**KERNEL)
def least_distances(t, tools, start, count, place, radius, skin, least):
    """Fill ``least`` (count,) with lower bounds of the distances from tool ``t`` of the points from ``start`` on.

    That of a plane is the distance, that of a plate the distance from the planes of the box's sides, inside of which
    the rounded box lies; other shapes but a swept edge have none. No point of ``place`` (x, y, z) is looked at closer
    once its bound exceeds its ``radius`` (n,) by ``skin`` [mm]. Without roots.
    """
    ox, oy, oz, ax, ay, az, bx, by, bz, cx, cy, cz, s0, s1, s2 = tool_frame(t, tools)[:15]
    kind, (x, y, z) = tools.kind[t], place
    if kind == SWEPT:
        _least_swept(t, tools, start, count, place, radius, skin, least)
    elif kind == PLANE:
        for k in range(U(count)):
            i = U(start) + k
            least[k] = cx * (x[i] - ox) + cy * (y[i] - oy) + cz * (z[i] - oz)
    elif kind == PLATE:
        for k in range(U(count)):
            i = U(start) + k
            px, py, pz = x[i] - ox, y[i] - oy, z[i] - oz
            u = abs(ax * px + ay * py + az * pz) - s0
            v = abs(bx * px + by * py + bz * pz) - s1
            w = abs(cx * px + cy * py + cz * pz) - s2
            least[k] = max(u, max(v, w))
    else:
        for k in range(U(count)):
            least[k] = -FAR


@njit(**INLINE)
def _least_swept(t, tools, start, count, place, radius, skin, least):
    """Distance from the sharp edge: height over its face, or distance from its wall by the nearest sample.

    Samples are one in plan, so that a point is a spacing farther than the nearest one at most. Beyond the box in plan
    the face goes on, or the wall is farther than the box.
    """
    frame, samples, (x, y, z) = tool_frame(t, tools), tools.samples, place
    ox, oy, oz, ax, ay, az, bx, by, bz, cx, cy, cz = frame[:12]
    spacing, _, sine, cosine, p0, p1, p2, p3, goes_on = frame[12:]
    for k in range(U(count)):
        i = U(start) + k
        px, py, pz = x[i] - ox, y[i] - oy, z[i] - oz
        u = abs(ax * px + ay * py + az * pz - p0) - p2
        v = abs(bx * px + by * py + bz * pz - p1) - p3
        w = cx * px + cy * py + cz * pz
        off = max(u, v)
        least[k] = w if goes_on > 0.0 else max(w, off * cosine + w * sine)
    inverse, last_x, last_y = 1.0 / spacing, float(tools.grid[t, 1] - 1), float(tools.grid[t, 2] - 1)
    at, stride = tools.grid[t, 0], tools.grid[t, 2]
    for k in range(U(count)):
        i = U(start) + k
        if least[k] >= radius[i] + skin:  # the samples are far from the processor
            continue
        px, py, pz = x[i] - ox, y[i] - oy, z[i] - oz
        u, v = ax * px + ay * py + az * pz, bx * px + by * py + bz * pz
        if max(abs(u - p0) - p2, abs(v - p1) - p3) >= 0.0:
            continue
        u, v, w = inverse * u, inverse * v, cx * px + cy * py + cz * pz
        on_u, on_v = min(max(u, 0.0), last_x), min(max(v, 0.0), last_y)
        near = samples[U(at + np.int64(on_u + 0.5) * stride + np.int64(on_v + 0.5))] - spacing
        bound = near * cosine + w * sine if u == on_u and v == on_v else -FAR
        least[k] = max(least[k], bound)


@njit(**KERNEL)
def tool_distance(t, tools, x, y, z):
    """:func:`frame_distance` of one point from tool ``t``."""
    return frame_distance(tools.kind[t], tool_frame(t, tools), tools.grid[t], tools.samples, x, y, z)
