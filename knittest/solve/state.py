"""State of a simulation between two chunks of steps, the steps themselves, and the interfaces of rigs and observers."""

import json
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from typing import Protocol

import numpy as np
from numba import get_num_threads

from knittest.base.arrays import Array
from knittest.base.history import Frame, InitialEquilibrium, Overlaps
from knittest.config.run import Solver
from knittest.kernels import monitor
from knittest.kernels.explicit import SCRATCH
from knittest.kernels.state import Drive, Tables, Tally
from knittest.kernels.vec import PARTITIONS
from knittest.models.boundary import Boundary, Readings
from knittest.models.explicit_model import (
    ExplicitModel,
    State,
    arrays_of,
    checked_array,
    columns,
    put_back,
    rows_of,
    with_prefix,
    without_prefix,
)
from knittest.solve.pace import Pace

#: energy of contacts over work at which yarns that are sheared have locked
LOCKED = 0.10


class Rig(Protocol):
    """Boundary motion, stop rule and channels of a virtual test."""

    duration: float  # longest time [ms]
    coordinate: str  # column of the curve that says how far the test has come
    force: str  # column of the force whose peak is kept
    mounted_at: float = 0.0  # time [ms] until which the specimen is mounted; it relaxes then, and energies start
    locks: bool = False  # ends where yarns lock
    locked_share: float = LOCKED  # energy of contacts over work from which on they have locked
    averaged_from: float = np.inf  # time [ms] from which the tools' forces on the nodes are averaged
    relaxed_rows: int = 0  # rows, at the end of each of which the specimen is relaxed; 0: it is not, see _relax_row
    rest_force: float = 0.0  # force [N] with which residual forces are compared where contacts bear none
    marks: tuple[float, ...] = ()  # shares of the duration at which frames are wanted besides even ones

    def constrain(self, boundary: Boundary) -> None:
        """Add supports, motions, loads and tools to ``boundary``."""

    def ring_time(self, wave_speed: float) -> float:
        """Time [ms] a wave of ``wave_speed`` [mm/ms] needs along the specimen."""

    def channels(self, time: float, readings: Readings) -> dict[str, float]:
        """Curve columns at ``time`` [ms] from the means of the last steps."""

    def share_done(self, time: float) -> float:
        """Share of the test (0 to 1) that is done at ``time`` [ms]."""
        return time / self.duration

    def adjust(self, run: "Simulation") -> None:
        """Adjust motions and damping of ``run`` after a row; nothing by default."""
        return

    def state(self) -> State:
        """Return what :meth:`adjust` has changed."""
        return {}

    def restore(self, state: State, tables: Tables) -> None:
        """Put back what :meth:`state` gave, also into the ``tables`` of the kernel."""
        return

    def is_finished(self, force: float, peak: float, broken: bool) -> bool:
        """Tell whether the test is over, with the force and its peak [N] and whether anything has failed."""
        return False


@dataclass
class ModelStepper:
    """A model on its way under ``drive``, in steps of ``dt`` [ms]; ``tally`` sums up what acts on it.

    ``kinetic``: kinetic energy [mJ] after the last steps; ``loss_rate``: energy that damping takes in one step [mJ];
    ``damping_loss``: what it has taken so far [mJ], by the trapezoidal rule over every call of :meth:`step`.
    """

    model: ExplicitModel
    drive: Drive
    tally: Tally
    dt: float
    time: float = 0.0
    kinetic: float = 0.0
    loss_rate: float = 0.0
    damping_loss: float = 0.0
    scratch: Array = field(default_factory=lambda: np.zeros((PARTITIONS, SCRATCH)), repr=False)
    pace: Pace = field(default_factory=lambda: Pace(get_num_threads()), repr=False)

    def step(self, steps: int) -> None:
        """Advance by ``steps`` time steps and book what damping took."""
        self.pace.advance(self._advance, steps)
        self.time += steps * self.dt
        kinetic, loss = monitor.kinetic_energy(self.model.nodes, self.model.mass, self.model.inertia, self.dt)
        self.damping_loss += 0.5 * (self.loss_rate + loss) * steps
        self.kinetic, self.loss_rate = kinetic, loss

    def _advance(self, steps: int) -> None:
        self.model.advance(steps, self.time, self.dt, self.drive, self.tally, self.scratch)

    def work(self) -> tuple[float, float, float, float]:
        """Work from outside, losses of friction, energy of eroded elements, losses of contact damping [mJ]."""
        external, friction, eroded, damped = self.tally.energy[:, :4].sum(axis=0).tolist()
        return external, friction, eroded, damped

    def friction_losses(self) -> dict[str, float]:
        """Parts of the losses of friction [mJ]: against spin at crossings of yarns, at tools, in the shear of shells;
        the rest is that of sliding contacts.
        """
        return dict(zip(("spin", "tools", "shear"), self.tally.energy[:, 4:7].sum(axis=0).tolist(), strict=True))

    @property
    def guide_energy(self) -> float:
        """Energy [mJ] that damping relative to guides has given back (:meth:`Boundary.guide`)."""
        return float(self.tally.energy[:, 8].sum())

    @property
    def recovered_energy(self) -> float:
        """Energy [mJ] that contacts found late were given (:meth:`ContactTracker.recover`)."""
        return float(self.tally.energy[:, 7].sum())


#: arrays of tools and their contacts that change
MOVING, TOUCHING = ("position", "velocity"), ("spring", "slipping", "pressure")
#: numbers of a run that change
SCALARS = (
    "time",
    "damping_loss",
    "kinetic",
    "loss_rate",
    "eroded",
    "peak",
    "step_share",
    "relaxation_loss",
    "moving_energy",
    "damping_share",
)
COSTS = ("advance_s", "penetration_max", "penetration_mean")
#: numbers of a frame
FRAME = ("time", "coordinate", "force")


@dataclass
class SimulationCost:
    """Steps, time step [ms], time spent advancing [s]; penetration over radius before failure; usual threads, 0 where
    they were not chosen.
    """

    steps: int = 0
    time_step: float = 0.0
    advance_s: float = 0.0
    penetration_max: float = 0.0
    penetration_mean: float = 0.0
    threads: int = 0


class TooFastError(Exception):
    """The speed of a simulation is too high; ``share`` of it meets the limits that are named in the ``reason``."""

    def __init__(self, share: float, reason: str) -> None:
        super().__init__(reason)
        self.share, self.reason = share, reason


@dataclass(frozen=True)
class EarlierFrame:
    """Parts of a frame of an earlier moment: time [ms], coordinate, force [N], positions of the nodes [mm]."""

    time: float
    coordinate: float
    force: float
    position: Array


@dataclass(frozen=True)
class Snapshot:
    """State of a simulation without its frames, and the frames, oldest first; frames never change once taken."""

    state: State
    frames: list[State]

    @property
    def time(self) -> float:
        """Simulated time [ms]."""
        return float(self.state["run/time"])


@dataclass(kw_only=True)
class Simulation(ModelStepper):
    """State of one run between chunks; ``row_steps`` steps of the present row are done."""

    rig: Rig
    solver: Solver
    row_steps: int = 0
    step_share: float = 1.0  # of the time step of the start, which contacts may have shortened since
    damping_share: float = 1.0  # of the configured damping, which a rig may have lowered
    kinetic_scale: float = 0.0  # of the specimen at clamp speed [mJ]
    start_energy: Array = field(
        default_factory=lambda: np.zeros(0)
    )  # elastic, as :func:`simulate._elastic_energies` [mJ]
    eroded: float = 0.0
    relaxation_loss: float = 0.0  # energy that relaxation at the ends of rows took [mJ]
    moving_energy: float = 0.0  # kinetic energy before the last of them [mJ]
    samples: list[tuple[float, Array]] = field(default_factory=list)
    rows: list[dict[str, float]] = field(default_factory=list)
    energy_rows: list[dict[str, float]] = field(default_factory=list)
    contact_rows: list[dict[str, float]] = field(default_factory=list)
    tool_force: Array = field(default_factory=lambda: np.zeros((0, 0)))  # sum of ``tool_rows`` samples
    tool_rows: int = 0
    overlaps: Overlaps = field(default_factory=Overlaps)
    rest: InitialEquilibrium | None = None
    frames: list[Frame] = field(default_factory=list)
    at_peak: EarlierFrame | None = None
    peak: float = 0.0
    cost: SimulationCost = field(default_factory=SimulationCost)

    @property
    def first_step(self) -> float:
        """Time step [ms] at the start."""
        return self.solver.safety * self.model.critical_step

    def shorten(self, share: float) -> None:
        """Continue with ``share`` of the present time step."""
        self.step_share *= share
        self.dt = self.first_step * self.step_share
        self.loss_rate *= share
        self.model.nodes.damping_factor[:] **= share

    def set_damping(self, share: float) -> None:
        """Continue with ``share`` of the configured damping."""
        change = share / self.damping_share
        self.damping_share = share
        self.loss_rate *= change
        self.model.nodes.damping_factor[:] **= change

    @property
    def rest_damping_factor(self) -> float:
        """Share of velocity that the damping leaves in one step where nothing broke a moment ago."""
        return float(np.exp(-self.solver.damping * self.damping_share * self.dt))

    def snapshot(self) -> Snapshot:
        """State of this run that changes, complete, as copies."""
        state = with_prefix("model", self.model.state()) | arrays_of(
            "run", self, (*SCALARS, "row_steps", "rest_damping_factor", "start_energy")
        )
        state |= arrays_of("cost", self.cost, ("steps", *COSTS)) | arrays_of("tally", self.tally, Tally._fields)
        state |= arrays_of("tools", self.drive.tools, MOVING) | arrays_of("touch", self.drive.touch, TOUCHING)
        state |= with_prefix("rows", columns(self.rows)) | with_prefix("energies", columns(self.energy_rows))
        state |= (
            with_prefix("rig", self.rig.state())
            | with_prefix("contacts", columns(self.contact_rows))
            | arrays_of("run", self, ("tool_force", "tool_rows"))
        )
        state["samples/time"] = np.array([t for t, _ in self.samples])
        state["samples/reaction"] = np.array([r for _, r in self.samples])
        state["n_frames"] = np.array(len(self.frames))
        if self.rest is not None:
            state["rest"] = np.array(json.dumps(asdict(self.rest)))
        if self.at_peak is not None:
            state |= {f"at_peak/{name}": np.asarray(value) for name, value in vars(self.at_peak).items()}
        return Snapshot(state, [frame_state(f) for f in self.frames])

    def restore(self, snapshot: Snapshot) -> None:
        """Put back what :meth:`snapshot` gave; raises :class:`InputError` if it is another model's."""
        state = snapshot.state
        self.model.restore(without_prefix(state, "model"))
        put_back(state, "tally", self.tally, Tally._fields)
        put_back(state, "tools", self.drive.tools, MOVING)
        put_back(state, "touch", self.drive.touch, TOUCHING)
        for name in SCALARS:
            setattr(self, name, float(checked_array(state, f"run/{name}", ())))
        self.dt = self.first_step * self.step_share
        self.start_energy = checked_array(state, "run/start_energy", self.start_energy.shape)
        for name in COSTS:
            setattr(self.cost, name, float(checked_array(state, f"cost/{name}", ())))
        self.row_steps, self.cost.steps = (
            int(checked_array(state, "run/row_steps", ())),
            int(checked_array(state, "cost/steps", ())),
        )
        self.rows, self.energy_rows = rows_of(without_prefix(state, "rows")), rows_of(without_prefix(state, "energies"))
        self.contact_rows = rows_of(without_prefix(state, "contacts"))
        self.rig.restore(without_prefix(state, "rig"), self.drive.tables)
        self.tool_force = checked_array(state, "run/tool_force", self.tool_force.shape)
        self.tool_rows = int(checked_array(state, "run/tool_rows", ()))
        self.samples = list(
            zip(checked_array(state, "samples/time").tolist(), checked_array(state, "samples/reaction"), strict=True)
        )
        self.frames = [frame_of(f) for f in snapshot.frames]
        if "rest" in state:
            self.rest = InitialEquilibrium(**json.loads(str(state["rest"])))
        if "at_peak/time" in state:
            time, coordinate, force = (float(checked_array(state, f"at_peak/{name}", ())) for name in FRAME)
            place = checked_array(state, "at_peak/position", self.model.nodes.position.shape)
            self.at_peak = EarlierFrame(time, coordinate, force, place)


def frame_state(frame: Frame) -> State:
    """A frame as arrays."""
    state = {f"frame/{name}": np.asarray(getattr(frame, name)) for name in (*FRAME, "position")}
    return state | with_prefix("field", frame.fields)


def frame_of(state: State) -> Frame:
    """Frame that :func:`frame_state` was made of."""
    time, coordinate, force = (float(checked_array(state, f"frame/{name}", ())) for name in FRAME)
    return Frame(time, coordinate, force, checked_array(state, "frame/position"), without_prefix(state, "field"))


#: phase in which the rig moves
TESTING = "running the test"


class Observer:
    """Observer of a simulation that does nothing; subclasses override the events that they need.

    What is observed never changes the numbers.
    """

    def phase(self, text: str) -> None:
        """Receive the name of a phase that begins, such as ``compiling kernels``."""

    def overlaps(self, found: Overlaps) -> None:
        """Receive the yarns that overlap at the start."""

    def progress(self, fraction: float, time_ms: float, step_us: float, kinetic_ratio: float) -> None:
        """Receive the share done (0 to 1), simulated time [ms], time step [us] and kinetic energy over work [-]."""

    def relaxation_progress(self, fraction: float) -> None:
        """Receive the share (0 to 1) done of the relaxation before the test."""

    def resume_from(self) -> Snapshot | None:
        """Return the state to resume from; None to start."""
        return None

    def report_resume(self, fraction: float, time_ms: float) -> None:
        """Receive where it resumes: share of the test (0 to 1), simulated time [ms]."""

    def speed_share(self) -> float:
        """Return the share of ``solver.speed`` of the state to resume from; 1 if there is none."""
        return 1.0

    def restarts(self, share: float, reason: str) -> None:
        """Receive the ``share`` of ``solver.speed`` at which the test restarts, and the reason; discard its state."""

    def visit(self, take: Callable[[], Snapshot]) -> None:
        """Receive the state after a chunk of steps, by calling ``take``; may raise to stop the simulation."""

    def visit_failure(self, take: Callable[[], Snapshot]) -> None:
        """Receive the state in which a check has failed."""


SILENT = Observer()
