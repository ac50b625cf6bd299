"""Relaxation of one periodic cell (one loop, one warp, one weft) from harmonic curves to a shape without penetration;
cached by its inputs.
"""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from math import ceil, sqrt
from typing import TYPE_CHECKING

import numpy as np

from knittest.base.arrays import Array
from knittest.base.errors import InputError, NumericalError
from knittest.config.fabric import Fabric
from knittest.fabric.cell import STITCHES, SYSTEMS, Cell, CellSpec, load_cell, save_cell
from knittest.fabric.loop import arc_length, polyline_length, start_loop
from knittest.fabric.topology import check_topology

if TYPE_CHECKING:
    from knittest.kernels.relaxation import Yarns


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
    """Yarns with the rest length ``total`` [mm] of the loop."""
    factor = np.array([total / yarns.total[0], 1.0, 1.0])
    return yarns._replace(arc=yarns.arc * factor[yarns.chain], length=yarns.length * factor, total=yarns.total * factor)


def _resample(curve: Array, n: int) -> Array:
    """``n`` points equally spaced along a polyline, the first at its start, the last one step before its end."""
    arc = arc_length(curve)
    at = arc[-1] * np.arange(n) / n
    return np.column_stack([np.interp(at, arc, curve[:, k]) for k in range(3)])


#: radii grow in these shares so that yarns push each other aside instead of passing through
RADIUS_STEPS = np.linspace(0.15, 1.0, 20)
#: a loop that starts too long is drawn in by this share at a time
DRAW_IN = 0.01
#: penalty [N/mm], force [N] and iterations of a step on the way
PENALTY, ON_THE_WAY, BRIEF = 100.0, 0.05, 400
#: penalties [N/mm] of the steps at the end; the last ones only if still needed
FIRM_PENALTIES = (100.0, 400.0, 800.0, 1600.0, 3200.0, 6400.0, 12800.0, 25600.0)
#: largest residual force in equilibrium: over EI / L^2 of the loop [-], as its forces grow with that, and in [N]
RESIDUAL, LARGEST_RESIDUAL = 0.1, 2e-4
#: iterations of a step at the end
PATIENT = 60_000
#: accepted penetration over radius and deviation of the loop length
PENETRATION, LENGTH_ERROR = 5e-3, 1e-3
#: residual force over that of the deepest contact which closest points may keep up that jump between segments
JUMPING = 0.1
#: cells that this process relaxed or read, so that a run and its manifest use the same cell
_cells_in_memory: dict[CellSpec, Cell] = {}
#: a loop drawn this much longer than its yarn cannot be relaxed
LOCKED = 0.05
#: loops are tried longer by this factor up to the last one, then to within a share of the shortest that relaxes
LONGER, LONGEST, SHORTEST = 1.04, 1.7, 0.01
#: sections are tried smaller by these shares where the loop locks on them
SMALLER = (0.97, 0.94, 0.9, 0.85, 0.8, 0.7)
#: the list of pairs holds while nodes move by less than half of this [mm]
SKIN = 0.25


def relaxed_cell(fabric: Fabric, compute: Callable[[], None] | None = None) -> Cell:
    """Relaxed cell of ``fabric`` from the cache, or computed (``compute`` is called first) and cached."""
    spec = CellSpec.of(fabric)
    if spec in _cells_in_memory:
        return _cells_in_memory[spec]
    cell = load_cell(spec)
    if cell is None:
        if compute is not None:
            compute()
        cell = relax_cell(spec)
        save_cell(cell)
    _cells_in_memory[spec] = cell
    return cell


def relax_cell(spec: CellSpec, finer: float = 1.0) -> Cell:
    """Relax the start shapes of ``spec``, of ``finer`` times as many nodes, and check their interlacing.

    Raises :class:`InputError` when the loop is too short for its yarns or too long for its cell,
    :class:`NumericalError` when it does not relax or yarns passed through each other.
    """
    try:
        return _relax_stepwise(spec, finer)
    except LockedLoopError as locked:
        raise InputError(_too_short_message(spec, locked)) from None
    except NumericalError as error:
        raise NumericalError(
            f"{error}: loops of {spec.loop_length:.4g} mm of a {spec.knit_diameter:.4g} mm yarn find no equilibrium "
            f"in cells of {spec.wale:.4g} x {spec.course:.4g} mm; expected another loop_length (relaxed plain knits "
            f"have {(STITCHES * spec.wale * spec.course) ** 0.5:.3g} mm), warp_density or weft_density, or thinner "
            "yarns"
        ) from None


class LockedLoopError(Exception):
    """A loop too short for its yarns, by the ``penetration`` [-] over a radius that is left."""

    def __init__(self, penetration: float) -> None:
        super().__init__()
        self.penetration = penetration


def _relax_stepwise(spec: CellSpec, finer: float) -> Cell:
    """Relaxed cell; raises :class:`LockedLoopError`."""
    state = _Relaxation(spec, finer)
    for share in RADIUS_STEPS:
        state.settle(PENALTY, ON_THE_WAY, BRIEF, share)
    state.draw_in()
    state.firm_up()
    cell = state.cell()
    check_topology(cell)
    return cell


class _Relaxation:
    """A relaxation in progress: positions ``x`` [mm], (n, 3), and the kernel's yarns."""

    def __init__(self, spec: CellSpec, finer: float) -> None:
        curves = start_curves(spec, finer)
        self.spec = spec
        self.x = np.vstack(curves)
        self.cuts = np.cumsum([len(c) for c in curves])[:-1]
        self.yarns = yarn_arrays(spec, curves)
        self.pairs = np.zeros((20_000, 4), np.int64)
        self.iterations = 0
        self.worst, self.deepest, self.residual = 0.0, 0.0, np.inf
        self.allowed = min(RESIDUAL * spec.bending_knit / spec.loop_length**2, LARGEST_RESIDUAL)

    def settle(self, penalty: float, tolerance: float, budget: int, share: float = 1.0) -> None:
        """Relax with ``share`` of the radii until forces are below ``tolerance`` [N] or the ``budget`` is spent."""
        from knittest.kernels.relaxation import periodic_pairs, relax

        yarns = self.yarns._replace(radius=share * self.yarns.radius, half_width=share * self.yarns.half_width)
        self.residual = np.inf
        while budget > 0 and self.residual >= tolerance:
            count = periodic_pairs(self.x, yarns, SKIN, self.pairs)
            if count > len(self.pairs):
                self.pairs = np.zeros((2 * count, 4), np.int64)
                continue
            steps, self.residual, seen, self.deepest = relax(
                self.x, yarns, self.pairs, count, penalty, tolerance, budget, SKIN
            )
            budget -= max(steps, 1)
            self.iterations += steps
            self.worst = max(self.worst, seen)

    def draw_in(self) -> None:
        """Shorten the rest length of a loop that started too long, step by step."""
        rest = self.yarns.total[0]
        while rest > self.spec.loop_length:
            rest = max((1.0 - DRAW_IN) * rest, self.spec.loop_length)
            self.yarns = with_loop_length(self.yarns, rest)
            self.settle(PENALTY, ON_THE_WAY, BRIEF)
            if self._loop_length() > (1.0 + LOCKED) * rest:
                raise LockedLoopError(self.deepest)

    def firm_up(self) -> None:
        """Come to rest with ever stiffer contact; a shorter rest length makes up for the stretch of a tight loop."""
        self.yarns = with_loop_length(self.yarns, self.spec.loop_length)
        for penalty in FIRM_PENALTIES:
            self.settle(penalty, self.allowed, PATIENT)
            stretch = self._loop_length() / self.spec.loop_length - 1.0
            if self.residual < self.allowed and self.deepest < PENETRATION and abs(stretch) < LENGTH_ERROR:
                return
            self.yarns = with_loop_length(self.yarns, self.yarns.total[0] / (1.0 + stretch))
        if self.deepest > PENETRATION or stretch > LENGTH_ERROR:
            raise LockedLoopError(self.deepest)
        if stretch < -LENGTH_ERROR:
            raise NumericalError(f"the loop is {-100.0 * stretch:.1f} % too short")
        pressed = FIRM_PENALTIES[-1] * self.deepest * float(self.yarns.radius.min())
        if self.residual < JUMPING * pressed:
            return
        raise NumericalError(
            f"the loop does not relax: residual force {self.residual:.2g} N, limit {self.allowed:.2g} N"
        )

    def cell(self) -> Cell:
        """The present state, moved to its place."""
        knit, warp, weft = np.split(self.x, self.cuts)
        numbers = (float(self.deepest), float(self.worst), float(self.residual), self.iterations)
        low, high = Cell(self.spec, knit, warp, weft, *numbers).faces
        place = np.array([warp[:, 0].mean() - 0.5 * self.spec.wale, weft[:, 1].mean(), 0.5 * (low + high)])
        return Cell(self.spec, knit - place, warp - place, weft - place, *numbers)

    def _loop_length(self) -> float:
        knit = self.x[: self.cuts[0]]
        return polyline_length(np.vstack([knit, knit[:1] + self.spec.periods["knit"]]))


def _too_short_message(spec: CellSpec, locked: LockedLoopError) -> str:
    inlays = f"{spec.diameter:g} mm warp and weft"
    if spec.warp is not None and spec.weft is not None:
        sizes = {"warp": spec.warp, "weft": spec.weft}
        inlays = " and ".join(f"{width:.3g} x {height:.3g} mm {s}" for s, (width, height) in sizes.items())
    return (
        f"fabric.loop_length = {spec.loop_length:g} mm is too short for {spec.wale:.3f} x {spec.course:.3f} mm "
        f"spacing with {inlays} and {spec.knit_diameter:g} mm knitting yarn: "
        f"the yarns lock (penetration {100.0 * locked.penetration:.1f} % of the radius); "
        f"{_loop_length_advice(spec)}{_packing_advice(spec)}"
    )


def _loop_length_advice(spec: CellSpec) -> str:
    """Advice on the length of the loop: the shortest that relaxes, tried."""
    low, high = 1.0, LONGER
    while high <= LONGEST and not _relaxes(spec, high):
        low, high = high, LONGER * high
    if high > LONGEST:
        return (
            f"loops up to {LONGEST:g} times as long lock too; expected thinner yarns (linear_density is in tex, 10 "
            "dtex) or a smaller warp_density or weft_density"
        )
    while high / low > 1.0 + SHORTEST:
        middle = sqrt(low * high)
        low, high = (low, middle) if _relaxes(spec, middle) else (middle, high)
    return f"expected a longer loop, such as {ceil(100.0 * high * spec.loop_length) / 100.0:g} mm, or thinner yarns"


def _relaxes(spec: CellSpec, longer: float) -> bool:
    with suppress(LockedLoopError, InputError, NumericalError):
        _relax_stepwise(replace(spec, loop_length=longer * spec.loop_length), 1.0)
        return True
    return False


def _packing_advice(spec: CellSpec) -> str:
    """Advice on the packing of elliptic inlays: how much denser they relax."""
    if spec.warp is None or spec.weft is None:
        return ""
    for share in SMALLER:
        warp, weft = ((share * width, share * height) for width, height in (spec.warp, spec.weft))
        with suppress(LockedLoopError, InputError, NumericalError):
            _relax_stepwise(replace(spec, warp=warp, weft=weft), 1.0)
            return f", or fabric.reinforcing.section.packing {share**-2:.3g} times as large"
    return f" (fabric.reinforcing.section.packing {SMALLER[-1] ** -2:.3g} times as large locks too)"
