"""Record of a simulation: mesh, frames, curves, energies, quality and cost. Numpy only."""

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from knittest.base.rest import Rest

Array = NDArray[np.float64]

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
    rest that its yarns started from (:func:`knittest.base.rest.rest_numbers`), none of shells.
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
