"""Wrinkles of a sheared square: height over the plane of the frame, on a regular grid."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import LinearNDInterpolator

from knittest.base.history import Frame, History

Array = NDArray[np.float64]

#: cells of the height map along a side
CELLS = 100
#: share of the side left out at every edge, where the needles hold the fabric
MARGIN = 0.05
#: share of the amplitude that a crest must rise above the trough before it to count
PROMINENCE = 0.5


@dataclass(frozen=True)
class Wrinkles:
    """Height map [mm] over x, y [mm] of a frame; ``amplitude`` is half its range [mm], ``count`` its crests along the
    diagonal that is compressed.
    """

    x: Array
    y: Array
    height: Array
    amplitude: float
    count: int


def measure_wrinkles(frame: Frame, history: History, side: float) -> Wrinkles:
    """Wrinkles of ``frame``; of yarns the mean over both reinforcing systems, which form the mid-surface."""
    start, points, values = _surface(frame, history)
    inside = np.abs(_square(start)).max(axis=1) < (0.5 - MARGIN) * side
    height = LinearNDInterpolator(points[:, :2], values)
    span = np.abs(points[inside, :2]).max(axis=0)
    x, y = np.meshgrid(np.linspace(-span[0], span[0], CELLS), np.linspace(-span[1], span[1], CELLS))
    mapped = height(x, y)
    # only what lies in the sheared square, less its margin
    shape = (np.abs(x) / max(span[0], 1e-9) + np.abs(y) / max(span[1], 1e-9)) <= 1.0
    mapped = np.where(shape, mapped, np.nan)
    amplitude = 0.5 * float(np.nanmax(mapped) - np.nanmin(mapped))
    profile = height(np.linspace(-span[0], span[0], 4 * CELLS), np.zeros(4 * CELLS))
    return Wrinkles(x, y, mapped, amplitude, _crests(profile[np.isfinite(profile)], amplitude))


def _surface(frame: Frame, history: History) -> tuple[Array, Array, Array]:
    """Start and present positions of the points of the mid-surface, and their height."""
    mesh, first = history.mesh, history.frames[0].position
    if mesh.kind == "shells":
        return first, frame.position, frame.position[:, 2] - 0.0
    names = list(mesh.part_names)
    nodes = np.unique(mesh.cells[np.isin(mesh.part, [names.index("warp"), names.index("weft")])])
    rise = frame.position[nodes, 2] - first[nodes, 2]
    return first[nodes], frame.position[nodes], rise


def _square(points: Array) -> Array:
    """Coordinates along the sides of the square whose diagonals lie along x and y."""
    return np.column_stack([points[:, 0] + points[:, 1], points[:, 1] - points[:, 0]]) / np.sqrt(2.0)


def _crests(profile: Array, amplitude: float) -> int:
    """Crests of a height profile that stand out by a share of the amplitude."""
    from scipy.signal import find_peaks

    if not amplitude > 0.0:
        return 0
    return len(
        find_peaks(np.concatenate([[profile.min()], profile, [profile.min()]]), prominence=PROMINENCE * amplitude)[0]
    )
