"""Bars of the picture frame at the frames of a run, which turn about the hinges at its corners, and the arms that hold
the fabric in a wider frame.
"""

from dataclasses import replace

import numpy as np

from knittest.base.history import Array, Body, History
from knittest.fabric.bias import turned
from knittest.laboratory.apparatus import at_frames, plate_block
from knittest.laboratory.picture_frame.frame_drawing import ARMS, WIDE

#: bars at the ends of the weft, then at those of the warp
NAMES = (("lower left bar", "upper right bar"), ("lower right bar", "upper left bar"))
#: what a bar stands out above and below the fabric, over its width: little, for wrinkles are seen from the side
OUT = 0.2
#: share by which a frame is wider than the fabric where it has arms
WIDER = 1e-6


def bars(history: History, sides: tuple[float, float]) -> list[Body]:
    """Bars of a frame of ``sides`` along weft and warp [mm] about the origin, from hinge to hinge and outside the line
    between them: those at the ends of the warp turn by half the shear angle, those at the ends of the weft back by it.
    Arms reach to them where the fabric does not; they are sheared as the fabric is.
    """
    half = 0.5 * np.deg2rad(at_frames(history, "frame_shear_angle_deg"))
    stretch = np.column_stack([np.cos(half) - np.sin(half), np.cos(half) + np.sin(half), np.ones_like(half)])
    found = []
    for normal, names in enumerate(NAMES):
        turn = _about_z(half if normal == 1 else -half)
        for name, way in zip(names, (-1.0, 1.0), strict=True):
            bar = _flat_bar(name, history, sides, normal, way)
            middle = turned(np.eye(3)[None, normal] * 0.5 * way * sides[normal])
            found.append(replace(bar, turn=turn, offset=middle * stretch - (turn @ middle[0])))
    return found + _arms(history, sides, stretch)


def _arms(history: History, sides: tuple[float, float], stretch: Array) -> list[Body]:
    """Flat sheets from the fabric to the bars, as one body that follows the ``stretch`` (n_frames, 3) along x, y, z."""
    flat = history.frames[0].position @ turned(np.eye(3)).T
    fabric, frame = np.abs(flat[:, :2]).max(axis=0), 0.5 * np.array(sides)
    corners = []
    for normal in np.flatnonzero(frame > (1.0 + WIDER) * fabric):
        for way in (-1.0, 1.0):
            sheet = np.zeros((4, 3))
            sheet[:, normal] = way * np.array([fabric[normal], fabric[normal], frame[normal], frame[normal]])
            sheet[:, 1 - normal] = fabric[1 - normal] * np.array([-1.0, 1.0, ARMS, -ARMS])
            corners.append(turned(sheet))
    if not corners:
        return []
    triangles = np.concatenate([4 * k + np.array([[0, 1, 2], [0, 2, 3]]) for k in range(len(corners))])
    turn = stretch[:, :, None] * np.eye(3)
    return [Body("arms", np.concatenate(corners), triangles, np.zeros_like(stretch), turn)]


def _flat_bar(name: str, history: History, sides: tuple[float, float], normal: int, way: float) -> Body:
    """A bar of the square frame, before any motion: at the end ``way`` (-1, 1) of weft or warp (``normal`` 0, 1)."""
    first, wide, radius = history.frames[0].position[:, 2], WIDE * max(sides), float(history.mesh.radius.max())
    centre = np.array([0.0, 0.0, 0.5 * (first.min() + first.max())])
    centre[normal] = 0.5 * way * (sides[normal] + wide)
    lengths = np.array([sides[0], sides[1], np.ptp(first) + 2.0 * (radius + OUT * wide)])
    lengths[normal] = wide
    body = plate_block(name, centre, lengths, np.zeros((len(history.frames), 3)))
    return replace(body, points=turned(body.points))


def _about_z(angle: Array) -> Array:
    """Matrices (n, 3, 3) that turn to the left by ``angle`` (n,) [rad]."""
    turn = np.tile(np.eye(3), (len(angle), 1, 1))
    turn[:, 0, 0] = turn[:, 1, 1] = np.cos(angle)
    turn[:, 1, 0] = np.sin(angle)
    turn[:, 0, 1] = -turn[:, 1, 0]
    return turn
