"""Start state of a relaxation: harmonic loop, harmonic warp and weft, and their arrays for the kernel."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from knittest.fabric.cell import SYSTEMS, CellSpec
from knittest.fabric.loop import start_loop
from knittest.fabric.spline import polyline_length

if TYPE_CHECKING:
    from knittest.kernels.relaxation import Yarns

Array = NDArray[np.float64]

#: nodes in one loop and in one wave while relaxing
LOOP_NODES, WAVE_NODES = 64, 16
#: stretching stiffness while relaxing [N]: far softer than the yarns, so that bending and contact set the time scale
STRETCHING = 300.0
#: neighbours along a yarn within this share of a half turn around it plus a margin [mm] do not touch
EXCLUDE, MARGIN = 1.2, 0.2


def wave_amplitude(crimp: float, wavelength: float) -> float:
    """Amplitude a [mm] of the harmonic a cos(2 pi y / wavelength) with the given crimp [-] (exact arc length)."""
    from scipy.optimize import brentq

    phase = np.linspace(0.0, 2.0 * np.pi, 401)

    def excess(amplitude: float) -> float:
        points = np.column_stack([wavelength * phase / (2.0 * np.pi), amplitude * np.cos(phase), np.zeros_like(phase)])
        return polyline_length(points) / wavelength - 1.0 - crimp

    return 0.0 if crimp <= 0.0 else float(brentq(excess, 0.0, wavelength))


def start_curves(spec: CellSpec, finer: float = 1.0) -> list[Array]:
    """Centre-lines [mm] of knit, warp and weft, each (n, 3), interlaced but not free of penetration, of ``finer`` times
    as many nodes.

    The waves are in phase: the warp is furthest back where the weft crosses, the weft furthest forward over the warp.
    """
    loop = start_loop(spec.wale, spec.course, spec.loop_length, 0.5 * (spec.height + spec.knit_diameter))
    knit = _resample(loop.points(np.linspace(0.0, 2.0 * np.pi, 2001)), round(finer * LOOP_NODES))
    nodes = round(finer * WAVE_NODES)
    turn = 2.0 * np.pi * (np.arange(nodes) / nodes - 0.5)
    side = np.full(nodes, 1.0)
    back = -wave_amplitude(spec.crimp_warp, spec.course) * np.cos(turn)
    warp = np.column_stack([0.5 * spec.wale * side, spec.course * turn / (2.0 * np.pi) + loop.weft, back])
    forth = -wave_amplitude(spec.crimp_weft, spec.wale) * np.cos(turn)
    weft = np.column_stack([spec.wale * turn / (2.0 * np.pi), loop.weft * side, spec.height + forth])
    return [knit, warp, weft]


def yarn_arrays(spec: CellSpec, curves: list[Array]) -> "Yarns":
    """Kernel arrays of knit, warp and weft whose rest lengths are those of ``curves``.

    The loop is bent from a straight yarn; the curves of warp and weft are their rest shape.
    """
    from knittest.kernels.relaxation import Yarns

    counts = np.array([len(c) for c in curves])
    first, chain = np.cumsum(counts) - counts, np.repeat(np.arange(3), counts)
    place = np.arange(counts.sum()) - first[chain]
    shift = np.array([spec.periods[s] for s in SYSTEMS])
    total = np.array([polyline_length(np.vstack([c, c[:1] + s])) for c, s in zip(curves, shift, strict=True)])
    half = np.array([spec.half_axes[s] for s in SYSTEMS])
    yarns = Yarns(
        after=first[chain] + (place + 1) % counts[chain],
        before=first[chain] + (place - 1) % counts[chain],
        after_shift=np.where((place == counts[chain] - 1)[:, None], shift[chain], 0.0),
        before_shift=np.where((place == 0)[:, None], -shift[chain], 0.0),
        chain=chain,
        arc=(total / counts)[chain] * (place + 0.5),
        rest=np.zeros((counts.sum(), 3)),
        length=total / counts,
        total=total,
        stretching=np.full(3, STRETCHING),
        bending=np.array([spec.bending_knit, spec.bending_warp, spec.bending_weft]),
        radius=half[:, 1],
        half_width=half[:, 0],
        exclude=EXCLUDE * (np.pi * half[:, 0] + MARGIN),
        period=np.array([[1, 0], [0, 1], [1, 0]]),
        spacing=np.array([spec.wale, spec.course]),
    )
    x = np.vstack(curves)
    curvature = x[yarns.before] + yarns.before_shift - 2.0 * x + x[yarns.after] + yarns.after_shift
    return yarns._replace(rest=np.where((chain == 0)[:, None], 0.0, curvature))


def with_loop_length(yarns: "Yarns", total: float) -> "Yarns":
    """The same yarns with rest length ``total`` [mm] of the loop."""
    factor = np.array([total / yarns.total[0], 1.0, 1.0])
    return yarns._replace(arc=yarns.arc * factor[yarns.chain], length=yarns.length * factor, total=yarns.total * factor)


def _resample(curve: Array, n: int) -> Array:
    """``n`` points equally spaced along a polyline, the first at its start, the last one step before its end."""
    arc = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1))])
    at = arc[-1] * np.arange(n) / n
    return np.column_stack([np.interp(at, arc, curve[:, k]) for k in range(3)])
