"""Axes of a picture along a line of sight, and shells shaded from far to near."""

import numpy as np

from knittest.base.history import Array

#: turn about the vertical and tilt of the line of sight against it [deg]
LOOKS = {"oblique": (30.0, 50.0), "top": (0.0, 0.0), "side": (0.0, 90.0)}
_LIGHT = np.array([-0.45, 0.45, 0.7714])


def sight(look: str = "oblique", *, turned: bool = False) -> Array:
    """Rows: right, up and towards the viewer, of one of :data:`LOOKS`; ``turned`` about the vertical by 90 deg more."""
    turn, tilt = np.deg2rad(LOOKS[look])
    turn += 0.5 * np.pi * turned
    right = np.array([np.cos(turn), np.sin(turn), 0.0])
    ahead = np.array([-np.sin(turn), np.cos(turn), 0.0])
    up = np.cos(tilt) * ahead + np.sin(tilt) * np.array([0.0, 0.0, 1.0])
    return np.array([right, up, np.cross(right, up)])


def shaded(corners: Array, colour: Array) -> tuple[Array, Array]:
    """Quadrilaterals (n, 4, 2) of ``corners`` (n, 4, 3) as seen, from far to near, and their ``colour`` (n, 3) shaded
    by Lambert's law from both sides.
    """
    shade = lit(np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]))
    order = np.argsort(corners[:, :, 2].mean(axis=1))
    return corners[order][:, :, :2], np.clip(colour * shade[:, None], 0.0, 1.0)[order]


def lit(normal: Array) -> Array:
    """Light on surfaces with ``normal`` (n, 3) of any length, by Lambert's law from both sides; 0.45 edge on."""
    length = np.maximum(np.linalg.norm(normal, axis=1), 1e-12)
    return np.asarray(0.45 + 0.6 * np.abs(normal @ _LIGHT) / length)
