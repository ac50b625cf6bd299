"""Signed distance of a point from a tool, in the tool's own axes; a new shape is one more function here."""

from math import sqrt

from numba import njit

from knittest.kernels.drive_state import CYLINDER, GRID, PLANE, PLATE
from knittest.kernels.options import KERNEL

#: distance [mm] returned where a sampled shape knows nothing
FAR = 1e9


@njit(**KERNEL)
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


@njit(**KERNEL)
def cylinder_distance(x, y, z, radius, half):
    """Cylinder along z, without caps: beyond its ends nothing touches."""
    rho = sqrt(x * x + y * y)
    if abs(z) > half or rho == 0.0:
        return FAR, 1.0, 0.0, 0.0
    return rho - radius, x / rho, y / rho, 0.0


@njit(**KERNEL)
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


@njit(**KERNEL)
def tool_distance(t, tools, x, y, z):
    """Signed distance [mm] of a point from tool ``t`` and the outward normal, in global axes.

    The normal is the gradient of the distance; of a sampled shape it is not quite of unit length, which keeps the
    contact force the gradient of an energy.
    """
    axes = tools.axes[t]
    px, py, pz = x - tools.position[t, 0], y - tools.position[t, 1], z - tools.position[t, 2]
    lx = axes[0, 0] * px + axes[0, 1] * py + axes[0, 2] * pz
    ly = axes[1, 0] * px + axes[1, 1] * py + axes[1, 2] * pz
    lz = axes[2, 0] * px + axes[2, 1] * py + axes[2, 2] * pz
    size, kind = tools.size[t], tools.kind[t]
    d, nx, ny, nz = FAR, 0.0, 0.0, 1.0
    if kind == PLANE:
        d = lz
    elif kind == PLATE:
        d, nx, ny, nz = plate_distance(lx, ly, lz, size[0], size[1], size[2], size[3])
    elif kind == CYLINDER:
        d, nx, ny, nz = cylinder_distance(lx, ly, lz, size[0], size[1])
    elif kind == GRID:
        d, nx, ny, nz = grid_distance(lx, ly, lz, size[0], tools.grid[t], tools.samples)
    return (
        d,
        nx * axes[0, 0] + ny * axes[1, 0] + nz * axes[2, 0],
        nx * axes[0, 1] + ny * axes[1, 1] + nz * axes[2, 1],
        nx * axes[0, 2] + ny * axes[1, 2] + nz * axes[2, 2],
    )
