"""Relaxes one periodic cell (one loop, one warp, one weft) to a shape without penetration; cached by its inputs."""

import hashlib
import json
import os
import tempfile
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from knittest.cache import cache_root
from knittest.config.fabric import Fabric
from knittest.errors import NumericalError
from knittest.fabric.loop import polyline_length, start_loop

Array = NDArray[np.float64]

#: nodes in one loop and in one wave while relaxing
LOOP_NODES, WAVE_NODES = 64, 16
#: stretching stiffness while relaxing [N]: soft, the length is restored by renewed rest lengths
RELAX_STRETCHING = 300.0
#: radii grow in these steps so that yarns push each other aside instead of passing through
RADIUS_STEPS = np.linspace(0.15, 1.0, 20)
#: penalty [N/mm] and largest pseudo-time step of the stages after full radius, and force at rest [N]
STAGES = ((100.0, 0.008), (400.0, 0.004))
AT_REST = 2e-4
#: neighbours along a yarn within this share of a half turn plus a margin [mm] do not touch
EXCLUDE, MARGIN = 1.2, 0.2
SKIN = 0.25
FORMAT = 1


@dataclass(frozen=True)
class CellSpec:
    """Inputs of the relaxation [mm, N mm^2]; crimps [-]."""

    wale: float
    course: float
    loop_length: float
    diameter: float
    knit_diameter: float
    crimp_warp: float
    crimp_weft: float
    bending_warp: float
    bending_weft: float
    bending_knit: float


@dataclass(frozen=True)
class Cell:
    """Relaxed centre-lines over one period [mm]: knit (n, 3) from sinker arc to sinker arc, warp along y, weft along x.

    The last point of each is one step before the period ends. ``deepest`` penetration over radius at rest, ``worst``
    seen on the way, ``length_error`` of the loop [-], ``residual`` force [N], ``thickness`` [mm].
    """

    spec: CellSpec
    knit: Array
    warp: Array
    weft: Array
    deepest: float
    worst: float
    residual: float

    @property
    def periods(self) -> dict[str, Array]:
        """Period vector [mm] of each yarn system."""
        wale, course = np.array([self.spec.wale, 0.0, 0.0]), np.array([0.0, self.spec.course, 0.0])
        return {"knit": wale, "warp": course, "weft": wale}

    @property
    def thickness(self) -> float:
        """Distance of the outermost yarn surfaces [mm]."""
        radius = {"knit": 0.5 * self.spec.knit_diameter, "warp": 0.5 * self.spec.diameter, "weft": 0.5 * self.spec.diameter}
        tops = [getattr(self, s)[:, 2].max() + r for s, r in radius.items()]
        return float(max(tops) - min(getattr(self, s)[:, 2].min() - r for s, r in radius.items()))

    @property
    def length_error(self) -> float:
        """Relative deviation of the loop length."""
        closed = np.vstack([self.knit, self.knit[:1] + self.periods["knit"]])
        return polyline_length(closed) / self.spec.loop_length - 1.0


def cell_spec(fabric: Fabric) -> CellSpec:
    """The cell of a fabric."""
    yarn = fabric.reinforcing
    return CellSpec(
        fabric.wale_spacing, fabric.course_spacing, fabric.kernel("loop_length"), yarn.kernel("beam_diameter"),
        fabric.knitting.kernel("beam_diameter"), yarn.kernel("crimp", "warp"), yarn.kernel("crimp", "weft"),
        yarn.kernel("bending_stiffness", "warp"), yarn.kernel("bending_stiffness", "weft"),
        fabric.knitting.kernel("bending_stiffness"),
    )  # fmt: skip


def relaxed_cell(fabric: Fabric, compute: Callable[[], None] | None = None) -> Cell:
    """Relaxed cell of ``fabric`` from the cache, or computed (``compute`` is called first) and cached."""
    spec = cell_spec(fabric)
    path = cache_root() / "cells" / f"{_key(spec)}.npz"
    cell = _load(path, spec)
    if cell is None:
        if compute is not None:
            compute()
        cell = relax_cell(spec)
        _save(path, cell)
    return cell


def relax_cell(spec: CellSpec) -> Cell:
    """Relax the harmonic start shapes of ``spec``; raises :class:`NumericalError` when it does not come to rest."""
    from knittest.fabric.topology import check_topology
    from knittest.kernels import relaxation

    x, yarns, cuts = _start(spec)
    pairs = np.zeros((400_000, 4), np.int64)
    worst, residual, deepest = 0.0, np.inf, 0.0
    stages = [(s, 100.0, 0.02, 0.05, 400) for s in RADIUS_STEPS]
    stages += [(1.0, penalty, largest, AT_REST, 60_000) for penalty, largest in STAGES]
    for scale, penalty, largest, tolerance, budget in stages:
        done = 0
        while done < budget:
            count = relaxation.periodic_pairs(x, yarns, scale, spec.wale, spec.course, SKIN, pairs)
            if count > len(pairs):
                pairs = np.zeros((2 * count, 4), np.int64)
                continue
            steps, residual, seen, deepest = relaxation.relax(
                x, yarns, scale, pairs, count, spec.wale, spec.course, penalty, 0.1 * largest, largest, tolerance,
                budget - done, SKIN,
            )  # fmt: skip
            done += max(steps, 1)
            worst = max(worst, seen)
            if residual < tolerance:
                break
    if residual > 20.0 * AT_REST:
        raise NumericalError(f"the loop does not come to rest: {residual:.2g} N are left; is fabric.loop_length possible?")
    knit, warp, weft = (x[a:b].copy() for a, b in zip(cuts[:-1], cuts[1:], strict=True))
    cell = Cell(spec, knit, warp, weft, float(deepest), float(worst), float(residual))
    check_topology(cell)
    return cell


def wave_amplitude(crimp: float, wavelength: float) -> float:
    """Amplitude a [mm] of the harmonic z = a cos(2 pi y / wavelength) with the given crimp [-] (exact arc length)."""
    from scipy.optimize import brentq

    phase = np.linspace(0.0, 2.0 * np.pi, 401)

    def excess(amplitude: float) -> float:
        points = np.column_stack([wavelength * phase / (2.0 * np.pi), amplitude * np.cos(phase), np.zeros_like(phase)])
        return polyline_length(points) / wavelength - 1.0 - crimp

    return 0.0 if crimp <= 0.0 else float(brentq(excess, 0.0, wavelength))


def _start(spec: CellSpec):  # type: ignore[no-untyped-def]  # the kernel's NamedTuple is imported lazily
    """Start positions, the kernel's yarn arrays and where each yarn begins."""
    loop = start_loop(spec.wale, spec.course, spec.loop_length, 0.5 * (spec.diameter + spec.knit_diameter))
    knit = _resample(loop.points(np.linspace(0.0, 2.0 * np.pi, 2001)), LOOP_NODES)
    share = np.arange(WAVE_NODES) / WAVE_NODES
    # in phase: the warp is furthest back where the weft crosses, the weft furthest forward where the warp crosses
    y = spec.course * (share - 0.5) + loop.weft
    back = -wave_amplitude(spec.crimp_warp, spec.course) * np.cos(2.0 * np.pi * (y - loop.weft) / spec.course)
    warp = np.column_stack([np.full(WAVE_NODES, 0.5 * spec.wale), y, back])
    x = spec.wale * (share - 0.5)
    forth = -wave_amplitude(spec.crimp_weft, spec.wale) * np.cos(2.0 * np.pi * x / spec.wale)
    weft = np.column_stack([x, np.full(WAVE_NODES, loop.weft), spec.diameter + forth])
    yarns = _yarns(spec, [knit, warp, weft])
    return np.vstack([knit, warp, weft]), yarns, np.cumsum([0, len(knit), len(warp), len(weft)])


def _resample(curve: Array, n: int) -> Array:
    """``n`` points equally spaced along a polyline, the first at its start, the last one step before its end."""
    arc = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1))])
    at = arc[-1] * np.arange(n) / n
    return np.column_stack([np.interp(at, arc, curve[:, k]) for k in range(3)])


def _yarns(spec: CellSpec, curves: list[Array]):  # type: ignore[no-untyped-def]
    from knittest.kernels.relaxation import Yarns

    period = np.array([[1, 0], [0, 1], [1, 0]])
    shift = np.column_stack([period * [spec.wale, spec.course], np.zeros(3)])
    counts = np.array([len(c) for c in curves])
    start, chain = np.cumsum(counts) - counts, np.repeat(np.arange(3), counts)
    place = np.arange(counts.sum()) - start[chain]
    after, before = start[chain] + (place + 1) % counts[chain], start[chain] + (place - 1) % counts[chain]
    after_shift = np.where((place == counts[chain] - 1)[:, None], shift[chain], 0.0)
    before_shift = np.where((place == 0)[:, None], -shift[chain], 0.0)
    x = np.vstack(curves)
    rest = x[before] + before_shift - 2.0 * x + x[after] + after_shift
    rest[chain == 0] = 0.0  # the loop is bent from a straight yarn, the waves of the inlays are their rest shape
    total = np.array([polyline_length(np.vstack([c, c[:1] + s])) for c, s in zip(curves, shift, strict=True)])
    total[0] = spec.loop_length
    diameter = np.array([spec.knit_diameter, spec.diameter, spec.diameter])
    length = total / counts
    return Yarns(
        after, before, after_shift, before_shift, chain, length[chain] * (place + 0.5), rest, length, total,
        np.full(3, RELAX_STRETCHING), np.array([spec.bending_knit, spec.bending_warp, spec.bending_weft]), np.zeros(3),
        0.5 * diameter, EXCLUDE * (0.5 * np.pi * diameter + MARGIN), period,
    )  # fmt: skip


def _key(spec: CellSpec) -> str:
    from knittest.kernels import relaxation

    source = Path(str(relaxation.__file__)).read_bytes() + Path(__file__).read_bytes()
    text = json.dumps([FORMAT, asdict(spec)], sort_keys=True).encode()
    return hashlib.sha256(source + text).hexdigest()[:24]


def _load(path: Path, spec: CellSpec) -> Cell | None:
    """The cached cell, or None if there is none that can be read."""
    try:
        with np.load(path, allow_pickle=False) as data:
            return Cell(spec, data["knit"], data["warp"], data["weft"], *(float(v) for v in data["numbers"]))
    except (OSError, ValueError, KeyError, EOFError):
        return None


def _save(path: Path, cell: Cell) -> None:
    """Write whole or not at all; a full disk only costs the next run its time."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=path.parent, suffix=".npz", delete=False) as stream:
            numbers = np.array([cell.deepest, cell.worst, cell.residual])
            np.savez(stream, knit=cell.knit, warp=cell.warp, weft=cell.weft, numbers=numbers)
        os.replace(stream.name, path)
    except OSError:
        return
