"""Outline of a picture frame in its plane: bars, hinges, the arms that hold the fabric, and the crosshead's pull."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from knittest.base.history import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes

BAR, ARM, CLAMP = "#59616a", "#c9ced4", "#2f353b"
#: width of a bar over its length, share of a side that the arms of a wider frame have, length of the arrows likewise
WIDE, ARMS, ARROW = 0.035, 0.98, 0.16


@dataclass(frozen=True)
class FrameShape:
    """Sides of frame and fabric [mm] and the shear angle [deg]."""

    frame: float
    fabric: float
    angle: float

    def corners(self, side: float) -> Array:
        """Corners of a square of ``side`` [mm] sheared with the frame, (4, 2): right, top, left, bottom."""
        half = 0.5 * np.deg2rad(self.angle)
        across, along = (np.sqrt(0.5) * side * (np.cos(half) + sign * np.sin(half)) for sign in (-1.0, 1.0))
        return np.array([[across, 0.0], [0.0, along], [-across, 0.0], [0.0, -along]])

    @property
    def reach(self) -> Array:
        """Half the width and height of all that is drawn [mm], (2,)."""
        arrow = np.array([0.0, (ARROW + 0.03) * self.frame])
        found: Array = self.corners(self.frame * (1.0 + 2.0 * WIDE)).max(axis=0) + arrow
        return found


def draw_frame(axes: "Axes", shape: FrameShape) -> None:
    """Draw the frame below what ``axes`` have, and fit their limits to it."""
    from matplotlib.patches import Polygon

    inner, outer = shape.corners(shape.fabric), shape.corners(shape.frame)
    for k in range(4):
        near, far = inner[[k, (k + 1) % 4]], outer[[k, (k + 1) % 4]]
        if shape.frame > shape.fabric:
            share = 0.5 * (1.0 - ARMS * shape.fabric / shape.frame)
            ends = far[0] + np.array([[share], [1.0 - share]]) * (far[1] - far[0])
            axes.add_patch(Polygon([near[0], near[1], ends[1], ends[0]], facecolor=ARM, edgecolor="none", zorder=0.5))
        axes.plot(*near.T, color=CLAMP, linewidth=1.6, zorder=3)
        out = far.mean(axis=0) / np.linalg.norm(far.mean(axis=0))
        beyond = WIDE * shape.frame * out
        axes.add_patch(Polygon([*far, far[1] + beyond, far[0] + beyond], facecolor=BAR, edgecolor="none", zorder=2))
    pins = outer * (1.0 + 0.5 * WIDE)
    axes.plot(*pins.T, "o", markersize=7, color="white", markeredgecolor=BAR, markeredgewidth=1.6, zorder=4)
    for end in (pins[1], pins[3]):
        tip = end + np.sign(end) * [0.0, ARROW * shape.frame]
        axes.annotate("", tip, end, arrowprops={"arrowstyle": "-|>", "color": CLAMP, "lw": 1.8}, zorder=5)
    x, y = shape.reach
    axes.set(xlim=(-x, x), ylim=(-y, y))
