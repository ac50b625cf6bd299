"""A field of shear angles over the plan of a specimen that is pulled along y."""

from typing import TYPE_CHECKING

from knittest.base.history import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.collections import Collection
    from matplotlib.colors import Normalize

#: area of a point [points^2]
POINT = 24


def shear_field(
    axes: "Axes", places: Array, value: Array, cmap: str = "viridis", norm: "Normalize | None" = None
) -> "Collection":
    """Draw ``value`` [deg], (n,), at ``places`` [mm]: polygons (n, k, 2) or points (n, 2); returns what has colours.

    ``norm`` of the colours ``cmap``; unless given, from the smallest to the largest value.
    """
    if places.ndim == 3:
        drawn: Collection = _patches(axes, places, value)
    else:
        drawn = axes.scatter(places[:, 0], places[:, 1], c=value, s=POINT, linewidths=0)
    drawn.set_cmap(cmap)
    if norm is not None:
        drawn.set_norm(norm)
    axes.set_aspect("equal")
    axes.set(xlabel="across the pull [mm]", ylabel="along the pull [mm]")
    return drawn


def _patches(axes: "Axes", places: Array, value: Array) -> "Collection":
    from matplotlib.collections import PolyCollection

    drawn = PolyCollection(list(places), array=value, edgecolors="face", linewidths=0.2)
    axes.add_collection(drawn)
    axes.autoscale_view()
    return drawn
