"""Relaxation of one periodic cell, a repeat of loops and inlays, from start curves to a shape without penetration;
cached by its inputs.
"""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from math import ceil, floor, sqrt
from typing import TYPE_CHECKING

import numpy as np

from knittest.base.arrays import Array
from knittest.base.errors import InputError, NumericalError
from knittest.config.base import Quantity
from knittest.config.fabric import Fabric
from knittest.config.structure import KNIT
from knittest.fabric.cell import (
    STITCHES,
    Cell,
    CellSpec,
    Curve,
    LayerSpec,
    curve_names,
    load_cell,
    period_of,
    save_cell,
)
from knittest.fabric.loop import StitchLoops, arc_length, polyline_length, start_loop
from knittest.fabric.topology import check_topology

if TYPE_CHECKING:
    from knittest.kernels.relaxation import Yarns


#: nodes in one loop and in one wave while relaxing
LOOP_NODES, WAVE_NODES = 64, 16
#: place of wefts in the start curve of loops of any stitches, from the middle of their course, over the course spacing
WEFT_LEVEL = 0.03
#: stretching stiffness while relaxing [N]: far softer than the yarns, so that bending and contact set the time scale
STRETCHING = 300.0
#: EI [N mm2] of loops from which on these stiffnesses and forces hold; those of thinner loops are in proportion to it
STIFF_LOOP = 0.5
#: spacings of soft yarns over the stated ones from which their relaxation may start
START_SHARES = (1.0, 0.9, 0.8, 0.7)
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
    """Centre-lines [mm], each (n, 3), in the order of :func:`curve_names`, interlaced but not free of penetration, of
    ``finer`` times as many nodes.

    Inlays have waves of their crimp. They are furthest back or forward where they cross the neighbouring layer.
    """
    nodes = round(finer * LOOP_NODES) * spec.repeat[0]
    if is_biaxial(spec):
        loop = start_loop(spec.wale, spec.course, spec.loop_length, 0.5 * (spec.height + spec.knit_diameter))
        courses, weft, levels = [loop.points(np.linspace(0.0, 2.0 * np.pi, 2001))], loop.weft, [0.0, spec.height]
    else:
        sides = np.array([[spec.side(i, j) for i in range(spec.repeat[0])] for j in range(spec.repeat[1])], float)
        layers, warps = 2.0 * spec.height, any(one.direction == "warp" for one in spec.layers)
        loops = StitchLoops.of(spec.wale, spec.course, layers, 0.5 * spec.knit_diameter, sides, warps)
        courses, weft = loops.of_length(spec.loop_length), WEFT_LEVEL * spec.course
        top = np.cumsum([one.height for one in spec.layers])
        levels = [float(t - 0.5 * one.height - 0.5 * layers) for t, one in zip(top, spec.layers, strict=True)]
    found = []
    for system, index in curve_names(spec):
        if system == KNIT:
            found.append(_resample(courses[index], nodes) + np.array([0.0, index * spec.course, 0.0]))
        else:
            number = spec.systems.index(system) - 1
            found.append(_start_inlay(spec, number, index, levels[number], weft, round(finer * WAVE_NODES)))
    return found


def is_biaxial(spec: CellSpec) -> bool:
    """Tell whether the structure is plain knit with a weft in every course before a warp in every wale.

    Its start curve is the harmonic one, whose relaxed cells the stored results of the two published fabrics rest on.
    """
    both = [one.direction for one in spec.layers] == ["warp", "weft"]
    return both and spec.stitches == ((1,),) and spec.repeat == (1, 1)


def _start_inlay(spec: CellSpec, number: int, index: int, level: float, weft: float, nodes: int) -> Array:
    """Centre-line [mm], (n, 3), of inlay ``index`` of layer ``number`` at height ``level``, ``nodes`` to a pitch."""
    layer, along_wales = spec.layers[number], spec.layers[number].direction == "warp"
    pitch, pitches = (spec.course, spec.repeat[1]) if along_wales else (spec.wale, spec.repeat[0])
    turn = 2.0 * np.pi * (np.arange(nodes * pitches) / nodes - 0.5)
    other, before = _neighbour(spec, number)
    step = 1 if other is None else other.step
    if step == 1:  # 1 where it crosses a yarn of the neighbouring layer
        wave = np.cos(turn) if along_wales else -np.cos(turn)
    else:
        wave = np.cos((turn if along_wales else turn - np.pi) / step - 2.0 * np.pi * _first(other) / step)
    wave = (-1.0 if before else 1.0) * wave_amplitude(layer.crimp, step * pitch) * wave
    side = np.full(nodes * pitches, 1.0)
    if along_wales:
        return np.column_stack(
            [(index + 0.5) * spec.wale * side, spec.course * turn / (2.0 * np.pi) + weft, level + wave]
        )
    return np.column_stack([spec.wale * turn / (2.0 * np.pi), index * spec.course + weft * side, level + wave])


def _neighbour(spec: CellSpec, number: int) -> tuple[LayerSpec | None, bool]:
    """Nearest layer of the other direction and whether it lies in front; without one, as if loops lay behind a weft."""
    layer = spec.layers[number]
    others = [k for k, one in enumerate(spec.layers) if one.direction != layer.direction]
    if not others:
        return None, layer.direction == "warp"
    nearest = min(others, key=lambda k: abs(k - number))
    return spec.layers[nearest], nearest > number


def _first(layer: LayerSpec | None) -> int:
    """First wale or course of ``layer`` that has an inlay."""
    return 0 if layer is None else layer.pattern.index(True)


def yarn_arrays(spec: CellSpec, curves: list[Array]) -> "Yarns":
    """Kernel arrays of the yarns in the order of :func:`curve_names`, whose rest lengths are those of ``curves``.

    Loops are bent from a straight yarn; the curves of inlays are their rest shape.
    """
    from knittest.kernels.relaxation import Yarns

    counts, systems = np.array([len(c) for c in curves]), [system for system, _ in curve_names(spec)]
    first, chain = np.cumsum(counts) - counts, np.repeat(np.arange(len(curves)), counts)
    place = np.arange(counts.sum()) - first[chain]
    shift = np.array([period_of(spec, s) for s in systems])
    total = np.array([polyline_length(np.vstack([c, c[:1] + s])) for c, s in zip(curves, shift, strict=True)])
    half = np.array([spec.half_axes[s] for s in systems])
    bending = {KNIT: spec.bending_knit} | {one.name: one.bending for one in spec.layers}
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
        stretching=np.full(len(curves), STRETCHING),
        bending=np.array([bending[s] for s in systems]),
        radius=half[:, 1],
        half_width=half[:, 0],
        exclude=EXCLUDE * (np.pi * half[:, 0] + MARGIN),
        period=np.array([[0, 1] if spec.axis(s) else [1, 0] for s in systems]),
        spacing=spec.size,
    )
    x = np.vstack(curves)
    curvature = x[yarns.before] + yarns.before_shift - 2.0 * x + x[yarns.after] + yarns.after_shift
    loops = np.array([s == KNIT for s in systems])
    return yarns._replace(rest=np.where(loops[chain][:, None], 0.0, curvature))


def with_loop_length(yarns: "Yarns", total: Array) -> "Yarns":
    """Yarns with the rest length ``total`` (n_courses,) [mm] of the courses of loops, which come first."""
    factor = np.ones(len(yarns.total))
    factor[: len(total)] = total / yarns.total[: len(total)]
    return yarns._replace(arc=yarns.arc * factor[yarns.chain], length=yarns.length * factor, total=yarns.total * factor)


def _resample(curve: Array, n: int) -> Array:
    """``n`` points equally spaced along a polyline, the first at its start, the last one step before its end."""
    arc = arc_length(curve)
    at = arc[-1] * np.arange(n) / n
    return np.column_stack([np.interp(at, arc, curve[:, k]) for k in range(3)])


#: radii grow in these shares so that yarns push each other aside instead of passing through
RADIUS_STEPS = np.linspace(0.15, 1.0, 20)
#: a loop that starts too long is shortened by this share at a time
SHORTENING = 0.01
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
#: overlap over the smaller radius up to which no yarn passed another: in one iteration they come nearer by less
PASSING = 0.5
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


def densities(pitches: Mapping[str, float], ref: str) -> dict[str, Quantity]:
    """Densities of spacings ``pitches`` [mm]."""
    return {name: Quantity(value=100.0 / pitch, source="derived", ref=ref) for name, pitch in pitches.items()}


def start_of_relaxation(fabric: Fabric) -> Fabric:
    """``fabric`` of soft yarns at its stated spacings, or at the first smaller ones at which its loops do not lock."""
    for share in START_SHARES if fabric.has_soft_yarns else ():
        pitches = {"warp_density": share * fabric.wale_spacing, "weft_density": share * fabric.course_spacing}
        closer = fabric if share == 1.0 else fabric.model_copy(update=densities(pitches, "start of the relaxation"))
        with suppress(InputError, NumericalError):
            relaxed_cell(closer)
            return closer
    return fabric


def keep_cell(cell: Cell) -> None:
    """Let :func:`relaxed_cell` return ``cell`` for a fabric of its spec in this process."""
    _cells_in_memory[cell.spec] = cell


def settled_cell(fabric: Fabric, points: Sequence[Array]) -> Cell:
    """Cell of ``fabric`` whose loops have come to rest at ``points`` [mm] elsewhere, one array (n, 3) a course.

    Each begins in a needle arc, as yarns of a strip do. The cell is moved to its place.
    """
    spec = CellSpec.of(fabric)
    nodes = np.vstack(list(points))
    low, high = nodes.min(axis=0), nodes.max(axis=0)
    place = np.array([points[0][0, 0], nodes[:, 1].mean() - 0.5 * (spec.size[1] - spec.course), 0.5 * (low + high)[2]])
    curves = []
    for (system, index), one in zip(curve_names(spec), points, strict=True):
        half, period = len(one) // (2 * spec.repeat[0]), period_of(spec, system)
        # half a loop earlier: curves of a cell begin in a sinker arc
        curves.append(Curve(system, index, np.vstack([one[-half:] - period, one[:-half]]) - place, period))
    return Cell(spec, tuple(curves), 0.0, 0.0, 0.0, 0)


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
        shorter = _shorter_loop(spec)
        length = f"a shorter loop_length, such as {shorter:g} mm" if shorter else "another loop_length"
        raise NumericalError(
            f"{error}: loops of {spec.loop_length:.4g} mm of a {spec.knit_diameter:.4g} mm yarn find no equilibrium "
            f"in cells of {spec.wale:.4g} x {spec.course:.4g} mm; expected {length} (relaxed plain knits "
            f"have {(STITCHES * spec.wale * spec.course) ** 0.5:.3g} mm), warp_density or weft_density, or thinner "
            "yarns"
        ) from None


def _shorter_loop(spec: CellSpec) -> float | None:
    """Shorter loop [mm] that relaxes, tried: slack loops curl over each other; None if none does."""
    share = 1.0 / LONGER
    while share * LONGEST > 1.0:
        if _relaxes(spec, share):
            return floor(100.0 * share * spec.loop_length) / 100.0
        share /= LONGER
    return None


class LockedLoopError(Exception):
    """A loop too short for its yarns, by the ``penetration`` [-] over a radius that is left."""

    def __init__(self, penetration: float) -> None:
        super().__init__()
        self.penetration = penetration


def _relax_stepwise(spec: CellSpec, finer: float) -> Cell:
    """Relaxed cell; raises :class:`LockedLoopError`.

    Loops that lock with soft yarns, which tight loops stretch, are tried again with stiff ones.
    """
    softness = min(spec.bending_knit / STIFF_LOOP, 1.0)
    if softness < 1.0:
        with suppress(LockedLoopError):
            return _relax_with(spec, finer, softness)
    return _relax_with(spec, finer, 1.0)


def _relax_with(spec: CellSpec, finer: float, softness: float) -> Cell:
    """Relaxed cell with stiffnesses of the relaxation times ``softness`` [-]; raises :class:`LockedLoopError`."""
    state = _Relaxation(spec, finer)
    start = state.cell()
    for share in RADIUS_STEPS:
        state.settle(PENALTY, ON_THE_WAY, BRIEF, share)
    state.soften(softness)
    state.shorten_loops()
    state.firm_up()
    cell = state.cell()
    check_topology(cell, start, continuous=cell.worst < PASSING)
    return cell


class _Relaxation:
    """A relaxation in progress: positions ``x`` [mm], (n, 3), and the kernel's yarns."""

    def __init__(self, spec: CellSpec, finer: float) -> None:
        curves = start_curves(spec, finer)
        self.spec = spec
        self.x = np.vstack(curves)
        self.cuts = np.cumsum([len(c) for c in curves])[:-1]
        self.courses, self.wanted = spec.repeat[1], spec.repeat[0] * spec.loop_length
        self.yarns, self.softness = yarn_arrays(spec, curves), 1.0
        self.pairs = np.zeros((20_000, 4), np.int64)
        self.iterations = 0
        self.worst, self.deepest, self.residual = 0.0, 0.0, np.inf
        self.allowed = min(RESIDUAL * spec.bending_knit / spec.loop_length**2, LARGEST_RESIDUAL)

    def soften(self, softness: float) -> None:
        """Scale the stiffnesses of stretching and contact, and the forces at rest on the way, by ``softness`` [-]."""
        self.softness = softness
        self.yarns = self.yarns._replace(stretching=softness * self.yarns.stretching)

    def settle(self, penalty: float, tolerance: float, budget: int, share: float = 1.0) -> None:
        """Relax with ``share`` of the radii until forces are below ``tolerance`` [N] or the ``budget`` is spent.

        ``penalty`` [N/mm] is that of stiff loops.
        """
        from knittest.kernels.relaxation import periodic_pairs, relax

        yarns = self.yarns._replace(radius=share * self.yarns.radius, half_width=share * self.yarns.half_width)
        self.residual = np.inf
        while budget > 0 and self.residual >= tolerance:
            count = periodic_pairs(self.x, yarns, SKIN, self.pairs)
            if count > len(self.pairs):
                self.pairs = np.zeros((2 * count, 4), np.int64)
                continue
            steps, self.residual, seen, self.deepest = relax(
                self.x, yarns, self.pairs, count, self.softness * penalty, tolerance, budget, SKIN
            )
            budget -= max(steps, 1)
            self.iterations += steps
            self.worst = max(self.worst, seen)

    def shorten_loops(self) -> None:
        """Shorten the rest length of loops that started too long, step by step."""
        rest = self.yarns.total[: self.courses]
        while (rest > self.wanted).any():
            rest = np.maximum((1.0 - SHORTENING) * rest, self.wanted)
            self.yarns = with_loop_length(self.yarns, rest)
            self.settle(PENALTY, self.softness * ON_THE_WAY, BRIEF)
            if (self._course_lengths() > (1.0 + LOCKED) * rest).any():
                raise LockedLoopError(self.deepest)

    def firm_up(self) -> None:
        """Come to rest with ever stiffer contact; a shorter rest length makes up for the stretch of a tight loop."""
        self.yarns = with_loop_length(self.yarns, np.full(self.courses, self.wanted))
        for penalty in FIRM_PENALTIES:
            self.settle(penalty, self.allowed, PATIENT)
            stretch = self._course_lengths() / self.wanted - 1.0
            if self.residual < self.allowed and self.deepest < PENETRATION and np.abs(stretch).max() < LENGTH_ERROR:
                return
            self.yarns = with_loop_length(self.yarns, self.yarns.total[: self.courses] / (1.0 + stretch))
        if self.deepest > PENETRATION or stretch.max() > LENGTH_ERROR:
            raise LockedLoopError(self.deepest)
        if stretch.min() < -LENGTH_ERROR:
            raise NumericalError(f"the loop is {-100.0 * stretch.min():.1f} % too short")
        pressed = self.softness * FIRM_PENALTIES[-1] * self.deepest * float(self.yarns.radius.min())
        if self.residual < JUMPING * pressed:
            return
        raise NumericalError(
            f"the loop does not relax: residual force {self.residual:.2g} N, limit {self.allowed:.2g} N"
        )

    def cell(self) -> Cell:
        """The present state, moved to its place."""
        names = curve_names(self.spec)
        curves = [
            Curve(system, index, points, period_of(self.spec, system))
            for (system, index), points in zip(names, np.split(self.x, self.cuts), strict=True)
        ]
        numbers = (float(self.deepest), float(self.worst), float(self.residual), self.iterations)
        cell = Cell(self.spec, tuple(curves), *numbers)
        low, high = cell.faces
        place = np.array([_mean_offset(cell, 0), _mean_offset(cell, 1), 0.5 * (low + high)])
        return replace(cell, curves=tuple(replace(one, points=one.points - place) for one in curves))

    def _course_lengths(self) -> Array:
        """Length [mm], (n_courses,), of the loops of each course."""
        curves = np.split(self.x, self.cuts)[: self.courses]
        period = period_of(self.spec, KNIT)
        return np.array([polyline_length(np.vstack([one, one[:1] + period])) for one in curves])


def _mean_offset(cell: Cell, axis: int) -> float:
    """Mean deviation [mm] along ``axis`` of the first layer of inlays across it from its place; 0 without one."""
    for layer in cell.spec.layers:
        if cell.spec.axis(layer.name) != axis:
            pitch, start = (cell.spec.wale, 0.5) if axis == 0 else (cell.spec.course, 0.0)
            off = [float(one.points[:, axis].mean()) - (one.index + start) * pitch for one in cell.of(layer.name)]
            return float(np.mean(off))
    return 0.0


def _too_short_message(spec: CellSpec, locked: LockedLoopError) -> str:
    sizes = Counter(_size_text(one) + f" {one.direction}" for one in spec.layers)
    inlays = "".join(f"{size} (x {count}), " if count > 1 else f"{size}, " for size, count in sizes.items())
    return (
        f"fabric.loop_length = {spec.loop_length:g} mm is too short for {spec.wale:.3f} x {spec.course:.3f} mm "
        f"spacing with {inlays}{spec.knit_diameter:g} mm knitting yarn: "
        f"the yarns lock (penetration {100.0 * locked.penetration:.1f} % of the radius); "
        f"{_loop_length_advice(spec)}{_packing_advice(spec)}"
    )


def _size_text(layer: LayerSpec) -> str:
    circle = layer.width == layer.height
    return f"{layer.width:g} mm" if circle else f"{layer.width:.3g} x {layer.height:.3g} mm"


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
        _relax_with(replace(spec, loop_length=longer * spec.loop_length), 1.0, 1.0)
        return True
    return False


def _packing_advice(spec: CellSpec) -> str:
    """Advice on the packing of elliptic inlays: how much denser they relax."""
    if not any(one.width > one.height for one in spec.layers):
        return ""
    for share in SMALLER:
        layers = tuple(
            replace(one, width=share * one.width, height=share * one.height) if one.width > one.height else one
            for one in spec.layers
        )
        with suppress(LockedLoopError, InputError, NumericalError):
            _relax_stepwise(replace(spec, layers=layers), 1.0)
            return f", or section.packing of the inlays {share**-2:.3g} times as large"
    return f" (section.packing of the inlays {SMALLER[-1] ** -2:.3g} times as large locks too)"
