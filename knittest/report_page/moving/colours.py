"""Colour maps of the moving view: equal steps of a value look equally far apart."""

from collections.abc import Callable

import numpy as np

from knittest.report_page.moving.recording import Array

#: colours of a map
SIZE = 256
#: white of sRGB (D65), and what XYZ is of its linear primaries (IEC 61966-2-1)
WHITE = np.array([0.95047, 1.0, 1.08883])
TO_XYZ = np.array(
    [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.119192, 0.9503041]]
)


def sequential() -> list[str]:
    """Colours of values from 0 on, as ``#rrggbb``: matplotlib's viridis, uniform in CAM02-UCS."""
    import matplotlib

    return _hex(matplotlib.colormaps["viridis"](np.linspace(0.0, 1.0, SIZE))[:, :3])


def diverging() -> list[str]:
    """Colours of values about 0, as ``#rrggbb``: Moreland's blue to red, either arm in equal steps of CIELAB."""
    import matplotlib

    return _hex(evened(lambda place: matplotlib.colormaps["coolwarm"](place)[:, :3]))


def evened(colours: Callable[[Array], Array]) -> Array:
    """Colours (:data:`SIZE`, 3) of a map of places 0 to 1, respaced so that either half has equal steps in CIELAB."""
    arms = []
    for start, end in ((0.0, 0.5), (0.5, 1.0)):
        place = np.linspace(start, end, 129)
        length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(lab(colours(place)), axis=0), axis=1))])
        arms.append(np.interp(np.linspace(0.0, length[-1], SIZE // 2), length, place))
    return colours(np.concatenate(arms))


def lab(rgb: Array) -> Array:
    """CIELAB (n, 3) of sRGB ``rgb`` (n, 3), 0 to 1."""
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    t = linear @ TO_XYZ.T / WHITE
    f = np.where(t > (6 / 29) ** 3, np.cbrt(t), t / (3 * (6 / 29) ** 2) + 4 / 29)
    return np.column_stack([116 * f[:, 1] - 16, 500 * (f[:, 0] - f[:, 1]), 200 * (f[:, 1] - f[:, 2])])


def _hex(rgb: Array) -> list[str]:
    return ["#" + "".join(f"{round(255 * float(c)):02x}" for c in colour) for colour in rgb]
