"""Side view of a bent strip with the plane it meets."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from knittest.base.figure import BLUE, GREY, ORANGE, dress, new_figure, save
from knittest.base.history import Array


def side_picture(
    path: Path,
    along: Array,
    height: Array,
    segments: NDArray[np.int64],
    *,
    overhang: float,
    angle: float,
    plane: float,
    title: str,
) -> None:
    """Elements seen from the side: ``along``, ``height`` (n_nodes,) [mm] from the edge, ``segments`` (n, 2)
    node numbers.

    ``plane`` is the angle [deg] of the plane through the edge, ``angle`` the chord's. Raises :class:`ResourceError`.
    """
    from matplotlib.collections import LineCollection

    figure = new_figure(9.0, 6.2)
    axes = figure.add_axes((0.08, 0.1, 0.88, 0.8))
    dress(axes)
    points = np.stack([along, height], axis=1)
    axes.add_collection(LineCollection(list(points[segments]), colors=BLUE, linewidths=0.8, alpha=0.6))
    reach = float(along.max())
    drop = np.tan(np.deg2rad(plane)) * reach
    axes.plot([0.0, reach], [0.0, -drop], "--", color=ORANGE, linewidth=1.6, label=f"plane at {plane:g} deg")
    chord = reach * np.tan(np.deg2rad(angle))
    axes.plot([0.0, reach], [0.0, -chord], ":", color=GREY, linewidth=1.4, label=f"chord at {angle:.2f} deg")
    axes.fill_between([min(float(along.min()), -5.0), 0.0], -0.15 * drop, -1.5, color="#d9dde1")
    axes.set_aspect("equal")
    axes.autoscale_view()
    axes.set(xlabel="from the edge [mm]", ylabel="height [mm]")
    axes.set_title(f"{title}\noverhang {overhang:.1f} mm, chord angle {angle:.2f} deg", loc="left", fontsize=11)
    axes.legend(loc="lower left", frameon=False)
    save(figure, path)
