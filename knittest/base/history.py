"""Record of a simulation: mesh, frames, curves, energies, quality and cost, initial equilibrium, forces beyond the
first failure. Numpy only.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from knittest.base.summary import Unjudged, Value

Array = NDArray[np.float64]

#: before the kind of a crossing: its mean normal force
FORCE = "normal_force_n."
#: how closely loops wrap each other (:mod:`knittest.models.crossings`)
WRAP = "loop_wrap"
#: Munden's constants K_c and K_s of relaxed plain knits (textbook values, apparel)
RELAXED = {"munden_kc": (5.0, 5.3), "munden_ks": (19.0, 21.6)}
#: label and format of each number
NUMBERS = {
    "draw_in_pct": ("loops drawn in by", "{:.3g} %"),
    "loop_tension_n": ("tension of the loops", "{:.3g} N"),
    FORCE: ("mean normal force of crossings", "{} N"),
    "thickness_mm": ("thickness", "{:.3f} mm"),
    "munden_kc": ("Munden's Kc", "{:.2f}"),
    "munden_ks": ("Munden's Ks", "{:.1f}"),
    WRAP: ("loops wrap to", "{:.3g} (1: straight and square, 0: closest points split)"),
    "out_of_balance_pct": ("out of balance", "{:.2g} % of the contact forces"),
}
#: wrap of loops below which they may snap: of 61 sheared cells at 0.05 or more one was lost by it, of 66 others 15
UNIQUE = 0.05
SPLITS = f"below {UNIQUE:.2f} a quarter of sheared cells snap and are refused: "
REMEDY = "take less draw-in or a longer loop"
#: of four cells that were lost by it at the speed and step of the study
RESCUED = "half the step let two of four such cells pass, half the speed one; else "
UNSETTLED = "not settled: yarns start free of force"
#: forces out of balance [%] above which numbers of rest are off by a tenth and more, not those of the test: settled on
#: from 2 % frames changed their tension by 0.2 %, from 5 and 53 % by 11 and 14 %, their forces by at most 0.9 %
CREEPING = 3.0
CREEPS = ": yarns creep, tension and crossings stated here may be off by a tenth and more, forces of frames by 1 %"


@dataclass(frozen=True)
class Rest:
    """Yarns at rest: mean axial force of the loops' yarn [N], thickness over the yarns' surfaces [mm], forces out of
    balance over those of contacts [-] (nan where nothing was settled), the mean normal force [N] of crossings that
    touch, by kind, and how closely loops ``wrap`` each other at most [-] (nan where none cross, or not known).
    """

    tension: float
    thickness: float
    residual: float
    normal_force: Mapping[str, float] = field(default_factory=dict)
    wrap: float = math.nan

    @property
    def warnings(self) -> tuple[str, ...]:
        """A warning of loops that wrap each other too closely for contacts at points."""
        return (f"loops wrap to {self.wrap:.3g}: {SPLITS}{REMEDY}",) if self.wrap < UNIQUE else ()

    @property
    def advice(self) -> str:
        """Remedy for a run whose motion or energies are off by that; empty where loops do not wrap so closely."""
        return f"loops wrap to {self.wrap:.3g}: {RESCUED}{REMEDY}" if self.wrap < UNIQUE else ""


def rest_numbers(rest: Rest, kc: float, ks: float, draw_in: float | None = None) -> dict[str, float]:
    """Numbers of ``rest`` by name with unit, with Munden's constants and a ``draw_in`` [-] of the loops."""
    drawn = {} if draw_in is None else {"draw_in_pct": 100.0 * draw_in}
    return drawn | {
        "loop_tension_n": rest.tension,
        **{f"{FORCE}{kind}": force for kind, force in sorted(rest.normal_force.items())},
        "thickness_mm": rest.thickness,
        "munden_kc": kc,
        "munden_ks": ks,
        **({} if math.isnan(rest.wrap) else {WRAP: rest.wrap}),
        "out_of_balance_pct": 100.0 * rest.residual,
    }


def of_all(specimens: Sequence[Mapping[str, float]]) -> list[dict[str, float]]:
    """The numbers of ``specimens`` with the same names in all: a kind of crossing that none of one touches has 0 N."""
    names = dict.fromkeys(name for one in specimens for name in one)
    return [{name: one.get(name, 0.0 if name.startswith(FORCE) else math.nan) for name in names} for one in specimens]


def rest_rows(numbers: Mapping[str, Value]) -> list[tuple[str, str]]:
    """Label and text of each of ``numbers``, flat as :func:`rest_numbers` has them, or with their spread."""
    means = {name: _mean(value) for name, value in numbers.items()}
    found = []
    for name, (label, text) in NUMBERS.items():
        if name == FORCE:
            forces = [f"{key.removeprefix(FORCE)} {force:.3g}" for key, force in means.items() if key.startswith(FORCE)]
            found += [(label, text.format(", ".join(forces)))] if forces else []
        elif name in means:
            found.append((label, _told(name, text, means[name])))
    return found


def rest_line(numbers: Mapping[str, Value]) -> str:
    """Tension of the loops, their wrap, thickness and how far they are settled: what of it a terminal shows."""
    means = {name: _mean(value) for name, value in numbers.items()}
    tension, thickness, residual = (means[n] for n in ("loop_tension_n", "thickness_mm", "out_of_balance_pct"))
    share = f"{residual:.0f}" if residual >= 10.0 else f"{residual:.2g}"
    state = f"out of balance {share} %" if math.isfinite(residual) else "not settled"
    doubt = " (yarns still creep: the tension may be off by a tenth or more)" if residual > CREEPING else ""
    wrap = f", wrap {means[WRAP]:.2g}" if math.isfinite(means.get(WRAP, math.nan)) else ""
    return f"loops {tension:.2g} N{wrap}, {thickness:.2f} mm thick, {state}{doubt}"


def _mean(value: Value) -> float:
    """A number, or the mean of those of an ensemble; nan where JSON has none."""
    if isinstance(value, Mapping):
        value = value["mean"]
    return math.nan if value is None else float(value)


def _told(name: str, text: str, value: float) -> str:
    if not math.isfinite(value):
        return UNSETTLED if name == "out_of_balance_pct" else "unknown"
    if name == "out_of_balance_pct" and value > CREEPING:
        return text.format(value) + CREEPS
    if name == WRAP and value < UNIQUE:
        return f"{text.format(value)}; {SPLITS}{REMEDY}"
    low, high = RELAXED.get(name, (0.0, 0.0))
    return text.format(value) + (f" (relaxed plain knits {low:g} to {high:g})" if high else "")


#: overlap at the start over the smaller radius that is worth a mention
OVERLAP_COUNTS = 0.01
#: quality is judged from this share of the work at the first failure on: below it everything is still start-up
START_UP = 0.05


@dataclass(frozen=True)
class Mesh:
    """Elements of a model as a viewer needs them.

    ``kind`` is ``beams`` (cells (n_el, 2)) or ``shells`` (cells (n_el, 4)); ``part`` (n_el,) indexes ``part_names``
    (``warp``, ``weft``, ``knit`` or ``fabric``); ``yarn`` (n_el,) numbers the yarn of a beam; ``radius`` [mm], (n_el,),
    is the beam radius or half the shell thickness.
    """

    kind: str
    cells: NDArray[np.int64]
    part: NDArray[np.int64]
    part_names: tuple[str, ...]
    yarn: NDArray[np.int64]
    radius: Array


@dataclass(frozen=True)
class Frame:
    """Positions [mm], (n_nodes, 3), and element fields, each (n_el,), at one time.

    Beams: ``axial_force`` [N], ``axial_strain`` [-], ``alive``. Shells: ``force_warp``, ``force_weft`` [N/mm],
    ``strain_warp``, ``strain_weft`` [-], ``shear_angle`` [rad], ``alive``.
    """

    time: float
    coordinate: float  # how far the test has come, in the unit of the rig's column (tensile: strain [%])
    force: float  # force of the rig [N]
    position: Array
    fields: dict[str, Array]


@dataclass(frozen=True)
class Body:
    """A part of the apparatus: closed or open surface of ``points`` (n, 3) [mm] and ``triangles`` (m, 3), at the k
    frames turned about the origin, or sheared, by the matrices ``turn`` (k, 3, 3), if it is at all, then moved by
    ``offset`` (k, 3) [mm].
    """

    name: str
    points: Array
    triangles: NDArray[np.int64]
    offset: Array
    turn: Array | None = None

    def place(self, frame: int) -> Array:
        """Points at a ``frame`` (from 0), (n, 3) [mm]."""
        turned = self.points if self.turn is None else self.points @ self.turn[frame].T
        return np.asarray(turned + self.offset[frame])

    def at_frames(self, numbers: NDArray[np.int64]) -> "Body":
        """The same at the frames ``numbers`` alone."""
        return replace(self, offset=self.offset[numbers], turn=None if self.turn is None else self.turn[numbers])

    def between(self, before: int, after: int, share: float) -> "Body":
        """The same at one moment, a ``share`` of the way from the frame ``before`` to the one ``after``."""

        def mixed(values: Array) -> Array:
            return np.asarray((1.0 - share) * values[[before]] + share * values[[after]])

        return replace(self, offset=mixed(self.offset), turn=None if self.turn is None else mixed(self.turn))


@dataclass(frozen=True)
class Overlaps:
    """Yarns that overlap at the start: how many contacts do by more than :data:`OVERLAP_COUNTS` of the smaller radius,
    the ``largest`` overlap over that radius [-], and the ``worst`` pairs as yarn names, place and overlap.
    """

    count: int = 0
    largest: float = 0.0
    worst: tuple[str, ...] = ()


@dataclass
class History:
    """Sampled channels: ``curve`` and ``energies`` map a column name with unit to an array (n_samples,).

    Tensile ``curve`` columns: time_ms, displacement_mm, strain_pct, force_n (mean of both clamps), force_moving_n,
    force_fixed_n, failed_warp, failed_weft, failed_knit (counts; shells: failed_fabric).
    The first of ``frames`` is the unloaded state (displacements count from it), the last the end of the run.
    ``energies`` columns: time_ms, kinetic_mj, internal_<part>_mj, the same by mechanism as <mechanism>_<part>_mj
    (yarns: stretching, bending, torsion; shells: stretching, bending, shear, in_plane_bending), hourglass_mj,
    contact_mj and of it contact_tools_mj, friction_mj and of it friction_<spin, tools, shear>_mj (crossings against
    spin, tools, shear of shells), contact_damping_mj (that of free tools too), contact_recovery_mj (energy given to
    contacts found late), damping_mj, eroded_mj, external_mj, balance_error_mj, kinetic_ratio, energy_error; elastic
    energies count from the start.
    ``contacts`` columns: time_ms, yarn_contacts (that touch), penetration_<max, mean, p50, p90, p99>_pct (over the
    smaller radius), force_free_overlap_max_pct (deepest overlap of yarns that carries no force, over the smaller
    radius, away from their ends), force_free_at_ends_max_pct (at them), found_late_max_pct (deepest
    overlap at which a contact was found late, so far), tool_contacts, tool_penetration_max_um.
    ``peak`` is the number of the frame at the largest force, before anything broke by it; None if none was kept.
    ``tool_force`` (n_tools, n_nodes) is the mean normal force [N] of each tool on each node while the rig wants it, or
    the last one where no sample lies there. ``rest`` is the state of yarns when the rig began to move; None of shells.
    """

    mesh: Mesh
    curve: dict[str, Array] = field(default_factory=dict)
    energies: dict[str, Array] = field(default_factory=dict)
    frames: list[Frame] = field(default_factory=list)
    first_failure: int | None = None  # sample index of the first failed element
    contacts: dict[str, Array] = field(default_factory=dict)
    tool_force: Array = field(default_factory=lambda: np.zeros((0, 0)))
    overlaps: Overlaps = field(default_factory=Overlaps)
    peak: int | None = None
    rest: Rest | None = None

    @property
    def at_peak(self) -> Frame:
        """The frame at the largest force."""
        return self.frames[self.peak] if self.peak is not None else max(self.frames, key=lambda frame: frame.force)


@dataclass(frozen=True)
class Quality:
    """Gates of a run; ratios are fractions, ``failures`` lists the gates that refuse the comparison.

    The largest shares up to the first failure, or to the end, of what the model takes for itself: damping, and that of
    contacts and free tools, of the work; hourglass control of the internal energy. ``beyond_law`` is the share of the
    shells sheared beyond the end of their law, ``drag_over_weight`` the drag of forming's damping at full speed over
    weight and holder's force.
    """

    ke_over_ie_max: float
    energy_error_max: float
    penetration_over_radius_max: float
    penetration_over_radius_mean: float
    added_mass_pct: float
    quasi_static: bool
    failures: tuple[str, ...]
    warnings: tuple[str, ...] = ()
    overlap_at_start: float = 0.0  # over the smaller radius
    force_free_overlap_max: float = 0.0  # of yarns, over the smaller radius
    damping_over_work_max: float = 0.0
    contact_damping_over_work_max: float = 0.0
    hourglass_over_internal_max: float = 0.0
    beyond_law: float = 0.0
    drag_over_weight: float = 0.0

    def refusing(self, reason: str) -> "Quality":
        """The same with one more failure."""
        return replace(self, failures=(*self.failures, reason))

    def warning(self, *texts: str) -> "Quality":
        """The same with more warnings."""
        return replace(self, warnings=(*self.warnings, *texts))


@dataclass(frozen=True)
class Cost:
    """Cost of a run."""

    wall_s: float
    cpu_s: float
    compile_s: float
    geometry_s: float
    steps: int
    elements: int
    element_steps_per_s: float
    threads: int
    time_step_us: float


@dataclass(frozen=True)
class Specimen:
    """Outcome of one specimen; ``facts`` are numbers of its model that pictures need, ``rest`` those of the state of
    rest that its yarns started from (:func:`knittest.base.history.rest_numbers`), none of shells.
    """

    history: History
    results: dict[str, float]
    quality: Quality
    cost: Cost
    yarns: dict[str, np.ndarray]
    facts: dict[str, float] = field(default_factory=dict)
    rest: dict[str, float] = field(default_factory=dict)


def judged_rows(history: History, *, to_failure: bool = True, reported_from: float = np.inf) -> slice:
    """Rows of the energies between start-up and the first failure, or of a test not ``to_failure`` the end.

    Start-up is over at a share of the largest work, of which a test that turns gives back, and at the latest when the
    first number is ``reported_from`` [ms].
    """
    energies = history.energies
    end = history.first_failure if to_failure and history.first_failure is not None else len(energies["time_ms"])
    end = max(end, 1)
    work = np.abs(energies["external_mj"][:end])
    start = int(np.argmax(work >= START_UP * work.max()))
    start = min(start, int(np.searchsorted(energies["time_ms"][:end], reported_from)))
    return slice(start, max(end, start + 1))


def peaks_beyond(histories: Sequence[History], coordinate: str, peaks: Sequence[float]) -> Unjudged | None:
    """Specimens of ``histories`` whose largest force, at ``peaks`` of the ``coordinate`` [%] of their curves, comes
    after the first failure; None if there is none.
    """
    failures = [_first_failure(history, coordinate) for history in histories]
    beyond = [(at, peak) for at, peak in zip(failures, peaks, strict=True) if peak > at]
    if not beyond:
        return None
    first, last = zip(*beyond, strict=True)
    return {"specimens": len(histories), "first_failure_pct": list(first), "peak_pct": list(last)}


def _first_failure(history: History, coordinate: str) -> float:
    """Coordinate [%] of the sample at which the first failure was seen; infinite where nothing failed."""
    if history.first_failure is None:
        return float("inf")
    when = history.energies["time_ms"][history.first_failure]
    return float(np.interp(when, history.curve["time_ms"], history.curve[coordinate]))


def unjudged_note(found: Mapping[str, object] | None) -> str:
    """Sentence on ``unjudged`` of summary.json; empty without, and where both strains are the same to two digits."""
    if not found:
        return ""
    first, peak = (_range(found.get(name)) for name in ("first_failure_pct", "peak_pct"))
    if not first or not peak or first == peak:
        return ""
    count, of = len(found["peak_pct"]), found["specimens"]  # type: ignore[arg-type]
    lies = "the peak lies" if of == 1 else f"the peaks of {count} of {of} specimens lie"
    return f"gates judged up to the first failure, at {first} % strain; {lies} beyond it, at {peak} %"


def _range(values: object) -> str:
    """``0.85`` of one number, ``0.80 to 0.92`` of several."""
    if not isinstance(values, Sequence) or not values:
        return ""
    low, high = f"{min(values):.2f}", f"{max(values):.2f}"
    return low if low == high else f"{low} to {high}"
