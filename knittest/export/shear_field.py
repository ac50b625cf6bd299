"""A field of shear angles over the plan of a specimen that is pulled along y."""

from typing import TYPE_CHECKING

from knittest.base.history import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.collections import Collection


def shear_field(axes: "Axes", places: Array, value: Array) -> "Collection":
    """Draw ``value`` [deg], (n,), at ``places`` [mm]: polygons (n, k, 2) or points (n, 2); returns what has colours."""
    drawn = _patches(axes, places, value) if places.ndim == 3 else _points(axes, places, value)
    axes.set_aspect("equal")
    axes.set(xlabel="across the pull [mm]", ylabel="along the pull [mm]")
    return drawn


def _patches(axes: "Axes", places: Array, value: Array) -> "Collection":
    from matplotlib.collections import PolyCollection

    drawn = PolyCollection(list(places), array=value, cmap="viridis", edgecolors="face", linewidths=0.2)
    axes.add_collection(drawn)
    axes.autoscale_view()
    return drawn


def _points(axes: "Axes", places: Array, value: Array) -> "Collection":
    return axes.scatter(places[:, 0], places[:, 1], c=value, s=8, cmap="viridis", linewidths=0)
