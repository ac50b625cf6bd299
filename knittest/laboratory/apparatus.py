"""Rigid parts of a test as frames, view and films show them: blocks of one section, and where they are."""

import numpy as np

from knittest.base.history import Array, Body, History, Specimen

#: depth of a jaw that holds no more of the specimen, over the width that it holds, and what it stands out beyond the
#: specimen over its depth
DEPTH, AROUND = 0.06, 0.35
#: facts of a strip between two jaws: where their faces are at the start, along the strip
STRIP_JAWS = ("fixed_jaw_mm", "moving_jaw_mm")


def block(name: str, section: Array, sides: tuple[float, float], offset: Array, *, along: int = 1) -> Body:
    """A block with the convex ``section`` (k, 2) [mm] in the plane of axis ``along`` (0: x, 1: y) and z, between
    ``sides`` [mm] of the other axis, moved by ``offset`` (n_frames, 3) [mm].
    """
    k = len(section)
    points = np.zeros((2 * k, 3))
    points[:, along], points[:, 2] = np.tile(section, (2, 1)).T
    points[:, 1 - along] = np.repeat(sides, k)
    first = np.arange(1, k - 1)
    lid = np.column_stack([np.zeros_like(first), first, first + 1])
    here, there = np.arange(k), np.roll(np.arange(k), -1)
    around = np.vstack([np.column_stack([here, there, k + there]), np.column_stack([here, k + there, k + here])])
    return Body(name, points, np.vstack([lid, lid + k, around]), offset)


def plate_block(name: str, centre: Array, lengths: Array, offset: Array) -> Body:
    """A plate of ``lengths`` (3,) about ``centre`` (3,) [mm], moved by ``offset`` (n_frames, 3) [mm]."""
    low, high = centre - 0.5 * lengths, centre + 0.5 * lengths
    section = np.array([[low[1], low[2]], [high[1], low[2]], [high[1], high[2]], [low[1], high[2]]])
    return block(name, section, (float(low[0]), float(high[0])), offset)


def jaw(
    name: str, history: History, axis: int, face: tuple[float, float], offset: Array, *, aside: float = AROUND
) -> Body:
    """A jaw on all of the specimen beyond its ``face``: where that is along ``axis`` (0: x, 1: y) [mm], and which way
    (-1 or 1) it holds the specimen from there on; moved by ``offset`` (n_frames, 3) [mm]. It stands out ``aside`` of
    the specimen by this share of its depth.
    """
    place, way = face
    first, radius = history.frames[0].position, float(history.mesh.radius.max())
    low, high = first.min(axis=0) - radius, first.max(axis=0) + radius
    held = way * ((high if way > 0.0 else low)[axis] - place)
    depth = max(float(held), DEPTH * float((high - low)[1 - axis]))
    out = depth * np.insert([aside, AROUND], axis, 0.0)
    low, high = low - out, high + out
    low[axis], high[axis] = sorted((place, place + way * depth))
    return plate_block(name, 0.5 * (low + high), high - low, offset)


def strip_jaws(specimen: Specimen, axis: int) -> list[Body]:
    """The fixed and the moving jaw of a strip that is pulled along ``axis`` (0: x, 1: y)."""
    history = specimen.history
    still = np.zeros((len(history.frames), 3))
    moved = still.copy()
    moved[:, axis] = at_frames(history, "displacement_mm")
    fixed, moving = (specimen.facts[name] for name in STRIP_JAWS)
    return [
        jaw("fixed jaw", history, axis, (fixed, -1.0), still),
        jaw("moving jaw", history, axis, (moving, 1.0), moved),
    ]


def at_frames(history: History, column: str) -> Array:
    """Values of a ``column`` of the curve at the times of the frames, (n_frames,), by the line between its rows."""
    times = [frame.time for frame in history.frames]
    return np.asarray(np.interp(times, history.curve["time_ms"], history.curve[column]))
