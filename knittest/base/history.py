"""Record of a simulation (mesh, frames, curves, energies, quality, cost) and the initial equilibrium of yarns."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from knittest.base.summary import UncheckedPeaks, Value

Array = NDArray[np.float64]

#: beginning of the name of the mean normal force of a kind of crossing
FORCE = "normal_force_n."
#: loop wrap ratio: how closely loops wrap each other (:mod:`knittest.models.crossings`)
WRAP = "loop_wrap"
#: Munden's constants K_c and K_s of relaxed plain knits (textbook values, apparel)
RELAXED = {"munden_kc": (5.0, 5.3), "munden_ks": (19.0, 21.6)}
#: label and format of each number
NUMBERS = {
    "loop_shortening_pct": ("loop shortening", "{:.3g} %"),
    "loop_tension_n": ("loop tension", "{:.3g} N"),
    FORCE: ("mean normal force of crossings", "{} N"),
    "thickness_mm": ("thickness", "{:.3f} mm"),
    "munden_kc": ("Munden's Kc", "{:.2f}"),
    "munden_ks": ("Munden's Ks", "{:.1f}"),
    WRAP: ("loop wrap ratio", "{:.3g} (1: straight yarns crossing at a right angle; 0: contact point not unique)"),
    "out_of_balance_pct": ("residual contact-force imbalance", "{:.2g} %"),
}
#: wrap ratio below which loops may snap: of 61 sheared cells at 0.05 or more one was lost by it, of 66 others 15
UNIQUE = 0.05
SPLITS = f"below {UNIQUE:.2f} the contact points of loops jump in a quarter of sheared cells, which are then rejected: "
REMEDY = "use less loop shortening (loop_shortening) or a longer loop"
#: of four cells that were lost by it at the speed and step of the study
RESCUED = "half the time step made two of four such cells pass, half the speed one; else "
UNSETTLED = "not computed: yarns start without contact forces"
#: imbalance [%] above which numbers of the initial equilibrium are off by 10 % and more, but not those of the test:
#: from 2 % on, frames changed tension by 0.2 %; from 5 and 53 % by 11 and 14 %, and their forces by at most 0.9 %
CREEPING = 3.0
CREEPS = ": loop tension and forces of crossings are accurate to about 10 %, forces of picture frames to 1 %"
#: imbalance [%] above which nothing is known of these numbers
UNBALANCED = 50.0
NO_EQUILIBRIUM = f"no equilibrium was found: imbalance {{:.2g}} %, limit {UNBALANCED:g} %"
SLACK = "negative: the loops are slack"


@dataclass(frozen=True)
class InitialEquilibrium:
    """Initial equilibrium of yarns: mean axial force [N] of the knitting yarn, thickness [mm] over the yarn surfaces,
    residual imbalance over contact forces [-] (nan if not computed), mean normal force [N] of touching crossings by
    kind, and smallest loop wrap ratio [-] (nan if unknown).
    """

    tension: float
    thickness: float
    residual: float
    normal_force: Mapping[str, float] = field(default_factory=dict)
    wrap: float = math.nan

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warning about a loop wrap ratio that is too small for point contacts."""
        return (f"loop wrap ratio {self.wrap:.3g}: {SPLITS}{REMEDY}",) if self.wrap < UNIQUE else ()

    @property
    def advice(self) -> str:
        """Remedy for failed quality checks of motion or energies at a small loop wrap ratio; else empty."""
        return f"loop wrap ratio {self.wrap:.3g}: {RESCUED}{REMEDY}" if self.wrap < UNIQUE else ""


def equilibrium_numbers(
    rest: InitialEquilibrium, kc: float, ks: float, loop_shortening: float | None = None
) -> dict[str, float]:
    """Numbers of ``rest`` by name with unit, with Munden's constants and ``loop_shortening`` [-]."""
    drawn = {} if loop_shortening is None else {"loop_shortening_pct": 100.0 * loop_shortening}
    return drawn | {
        "loop_tension_n": rest.tension,
        **{f"{FORCE}{kind}": force for kind, force in sorted(rest.normal_force.items())},
        "thickness_mm": rest.thickness,
        "munden_kc": kc,
        "munden_ks": ks,
        **({} if math.isnan(rest.wrap) else {WRAP: rest.wrap}),
        "out_of_balance_pct": 100.0 * rest.residual,
    }


def with_common_names(specimens: Sequence[Mapping[str, float]]) -> list[dict[str, float]]:
    """Numbers of ``specimens`` with the same names in all; a kind of crossing without contact has 0 N."""
    names = dict.fromkeys(name for one in specimens for name in one)
    return [{name: one.get(name, 0.0 if name.startswith(FORCE) else math.nan) for name in names} for one in specimens]


def equilibrium_rows(numbers: Mapping[str, Value]) -> list[tuple[str, str]]:
    """Label and text of each of ``numbers`` of :func:`equilibrium_numbers`, single or with their spread."""
    means = {name: _mean(value) for name, value in numbers.items()}
    found = []
    for name, (label, text) in NUMBERS.items():
        if name == FORCE:
            forces = [f"{key.removeprefix(FORCE)} {force:.3g}" for key, force in means.items() if key.startswith(FORCE)]
            found += [(label, text.format(", ".join(forces)))] if forces else []
        elif name in means:
            found.append((label, _number_text(name, text, means[name])))
    return found


def equilibrium_line(numbers: Mapping[str, Value]) -> str:
    """Line of a terminal on the initial equilibrium: thickness and loop tension, with their accuracy."""
    means = {name: _mean(value) for name, value in numbers.items()}
    residual = means["out_of_balance_pct"]
    notes = [SLACK] if means["loop_tension_n"] < 0.0 else []
    if not math.isfinite(residual):
        notes.append("equilibrium not computed")
    elif residual > UNBALANCED:
        notes.append(NO_EQUILIBRIUM.format(residual))
    elif residual > CREEPING:
        notes.append("accurate to about 10 %")
    note = f" ({'; '.join(notes)})" if notes else ""
    return f"thickness {means['thickness_mm']:.2f} mm, loop tension {means['loop_tension_n']:.2g} N{note}"


def _mean(value: Value) -> float:
    """Number, or mean of an ensemble; nan if JSON has none."""
    if isinstance(value, Mapping):
        value = value["mean"]
    return math.nan if value is None else float(value)


def _number_text(name: str, text: str, value: float) -> str:
    if not math.isfinite(value):
        return UNSETTLED if name == "out_of_balance_pct" else "unknown"
    if name == "out_of_balance_pct" and value > UNBALANCED:
        return f"{NO_EQUILIBRIUM.format(value)}. Loop tension and forces of crossings are not reliable"
    if name == "out_of_balance_pct" and value > CREEPING:
        return text.format(value) + CREEPS
    if name == "loop_tension_n" and value < 0.0:
        return f"{text.format(value)} ({SLACK})"
    if name == WRAP and value < UNIQUE:
        return f"{text.format(value)}; {SPLITS}{REMEDY}"
    low, high = RELAXED.get(name, (0.0, 0.0))
    return text.format(value) + (f" (relaxed plain knits: {low:g} to {high:g})" if high else "")


#: initial overlap over the smaller radius that is reported
OVERLAP_COUNTS = 0.01
#: share of the work at the first failure at which start-up ends; quality checks begin there
START_UP = 0.05


@dataclass(frozen=True)
class Mesh:
    """Elements of a model for viewers.

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
    """Part of the apparatus: surface of ``points`` (n, 3) [mm] and ``triangles`` (m, 3). At frame k it is turned about
    the origin or sheared by the matrix ``turn[k]`` (3, 3), if given, and moved by ``offset[k]`` (3,) [mm].
    """

    name: str
    points: Array
    triangles: NDArray[np.int64]
    offset: Array
    turn: Array | None = None

    def place(self, frame: int) -> Array:
        """Points (n, 3) [mm] at a ``frame`` from 0."""
        turned = self.points if self.turn is None else self.points @ self.turn[frame].T
        return np.asarray(turned + self.offset[frame])

    def select_frames(self, numbers: NDArray[np.int64]) -> "Body":
        """Body at the frames ``numbers`` only."""
        return replace(self, offset=self.offset[numbers], turn=None if self.turn is None else self.turn[numbers])

    def interpolate(self, before: int, after: int, share: float) -> "Body":
        """Body at one time, a ``share`` of the way from frame ``before`` to frame ``after``."""

        def mixed(values: Array) -> Array:
            return np.asarray((1.0 - share) * values[[before]] + share * values[[after]])

        return replace(self, offset=mixed(self.offset), turn=None if self.turn is None else mixed(self.turn))


@dataclass(frozen=True)
class Overlaps:
    """Initial yarn overlaps: ``count`` of contacts above :data:`OVERLAP_COUNTS` of the smaller radius, ``largest``
    overlap over that radius [-], and ``worst`` pairs as yarn names, position and overlap.
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
    contact_mj and its part contact_tools_mj, friction_mj and its parts friction_<spin, tools, shear>_mj (crossings
    against spin, tools, shear of shells), contact_damping_mj (also of free tools), contact_recovery_mj (energy of
    contacts detected late), damping_mj, eroded_mj, external_mj, balance_error_mj, kinetic_ratio, energy_error; elastic
    energies count from the start.
    ``contacts`` columns: time_ms, yarn_contacts (touching), penetration_<max, mean, p50, p90, p99>_pct (over the
    smaller radius), force_free_overlap_max_pct (largest force-free overlap of yarns over the smaller radius, away from
    their ends), force_free_at_ends_max_pct (at the ends), found_late_max_pct (largest overlap so far at late detection
    of a contact), tool_contacts, tool_penetration_max_um.
    ``peak`` is the number of the frame at the largest force, before failure; None if none was kept. ``tool_force``
    (n_tools, n_nodes) is the mean normal force [N] of each tool on each node while the rig records it, or the last one.
    ``rest`` is the initial equilibrium of yarns; None for shells.
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
    rest: InitialEquilibrium | None = None

    @property
    def peak_frame(self) -> Frame:
        """Frame at the largest force."""
        return self.frames[self.peak] if self.peak is not None else max(self.frames, key=lambda frame: frame.force)


@dataclass(frozen=True)
class Quality:
    """Values of the quality checks of a run as fractions; ``failures`` lists the failed checks.

    Losses are the largest up to the first failure, or to the end: damping, and damping of contacts and free tools, over
    work; hourglass energy over internal energy. ``beyond_law`` is the share of shell elements beyond the end of their
    shear law, ``drag_over_weight`` the damping force of forming at full speed over weight and blank-holder force.
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

    def with_failed_check(self, reason: str) -> "Quality":
        """Quality with one more failed check."""
        return replace(self, failures=(*self.failures, reason))

    def with_warnings(self, *texts: str) -> "Quality":
        """Quality with more warnings."""
        return replace(self, warnings=(*self.warnings, *texts))


@dataclass(frozen=True)
class Cost:
    """Times [s] and sizes of a run."""

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
    """Outcome of one specimen; ``facts`` are for pictures, ``rest`` is its initial equilibrium (empty for shells)."""

    history: History
    results: dict[str, float]
    quality: Quality
    cost: Cost
    yarns: dict[str, np.ndarray]
    facts: dict[str, float] = field(default_factory=dict)
    rest: dict[str, float] = field(default_factory=dict)


def checked_rows(history: History, *, to_failure: bool = True, reported_from: float = np.inf) -> slice:
    """Rows of the energies from the end of start-up to the first failure, or not ``to_failure`` to the end.

    Start-up ends at a share of the largest work, but not after the first reported number, ``reported_from`` [ms].
    """
    energies = history.energies
    end = history.first_failure if to_failure and history.first_failure is not None else len(energies["time_ms"])
    end = max(end, 1)
    work = np.abs(energies["external_mj"][:end])
    start = int(np.argmax(work >= START_UP * work.max()))
    start = min(start, int(np.searchsorted(energies["time_ms"][:end], reported_from)))
    return slice(start, max(end, start + 1))


def peaks_after_failure(histories: Sequence[History], coordinate: str, peaks: Sequence[float]) -> UncheckedPeaks | None:
    """Specimens whose peak force, at ``peaks`` [%] of ``coordinate``, follows the first failure; None without any."""
    failures = [
        np.interp(h.energies["time_ms"][h.first_failure], h.curve["time_ms"], h.curve[coordinate])
        if h.first_failure is not None else math.inf
        for h in histories
    ]  # fmt: skip
    beyond = [(float(at), peak) for at, peak in zip(failures, peaks, strict=True) if peak > at]
    if not beyond:
        return None
    first, last = zip(*beyond, strict=True)
    return {"specimens": len(histories), "first_failure_pct": list(first), "peak_pct": list(last)}


def unchecked_peak_note(found: Mapping[str, object] | None) -> str:
    """Note on ``unjudged`` of summary.json; empty without it, and if both strains agree to two digits."""
    if not found:
        return ""
    first, peak = (_range_text(found.get(name)) for name in ("first_failure_pct", "peak_pct"))
    if not first or not peak or first == peak:
        return ""
    count, of = len(found["peak_pct"]), found["specimens"]  # type: ignore[arg-type]
    after = "The peak force comes later" if of == 1 else f"The peak forces of {count} of {of} specimens come later"
    return (
        f"Quality checks cover the run up to the first yarn failure ({first} % strain). {after} ({peak} %) and "
        f"{'is' if of == 1 else 'are'} not checked"
    )


def _range_text(values: object) -> str:
    """Text such as ``0.85`` of one number, ``0.80 to 0.92`` of several."""
    if not isinstance(values, Sequence) or not values:
        return ""
    low, high = f"{min(values):.2f}", f"{max(values):.2f}"
    return low if low == high else f"{low} to {high}"
