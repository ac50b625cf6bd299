"""State of a simulation between two chunks, and the same as arrays for a checkpoint."""

import json
from dataclasses import asdict, dataclass, field

import numpy as np
from numpy.typing import NDArray

from knittest.base.history import Frame, Overlaps
from knittest.base.rest import Rest
from knittest.config.run import Solver
from knittest.kernels.state import Tally
from knittest.models.snapshot import State, arrays_of, columns, entry, prefixed, put_back, rows_of, under
from knittest.solve.rig import Rig
from knittest.solve.stepping import Stepping

Array = NDArray[np.float64]

#: arrays of tools and their contacts that change
MOVING, TOUCHING = ("position", "velocity"), ("spring", "slipping", "pressure")
#: numbers of a run that change
SCALARS = ("time", "damping_loss", "kinetic", "loss_rate", "eroded", "peak", "step_share")
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
class Kept:
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
class Simulation(Stepping):
    """State of one run between chunks; ``row_steps`` steps of the present row are done."""

    rig: Rig
    solver: Solver
    row_steps: int = 0
    step_share: float = 1.0  # of the time step of the start, which contacts may have shortened since
    kinetic_scale: float = 0.0  # of the specimen at clamp speed [mJ]
    start_energy: Array = field(default_factory=lambda: np.zeros(0))  # elastic, as :func:`simulate._elastic` [mJ]
    eroded: float = 0.0
    samples: list[tuple[float, Array]] = field(default_factory=list)
    rows: list[dict[str, float]] = field(default_factory=list)
    energy_rows: list[dict[str, float]] = field(default_factory=list)
    contact_rows: list[dict[str, float]] = field(default_factory=list)
    tool_force: Array = field(default_factory=lambda: np.zeros((0, 0)))  # sum of ``tool_rows`` samples
    tool_rows: int = 0
    overlaps: Overlaps = field(default_factory=Overlaps)
    rest: Rest | None = None
    frames: list[Frame] = field(default_factory=list)
    at_peak: Kept | None = None
    peak: float = 0.0
    cost: SimulationCost = field(default_factory=SimulationCost)

    @property
    def first_step(self) -> float:
        """Time step [ms] at the start."""
        return self.solver.safety * self.model.critical_step

    def shorten(self, share: float) -> None:
        """Go on with ``share`` of the present time step."""
        self.step_share *= share
        self.dt = self.first_step * self.step_share
        self.loss_rate *= share
        self.model.nodes.damping_factor[:] **= share

    @property
    def rest_damping_factor(self) -> float:
        """Share of velocity that the configured damping leaves in one step."""
        return float(np.exp(-self.solver.damping * self.dt))

    def snapshot(self) -> Snapshot:
        """State of this run that changes, complete, as copies."""
        state = prefixed("model", self.model.state()) | arrays_of(
            "run", self, (*SCALARS, "row_steps", "rest_damping_factor", "start_energy")
        )
        state |= arrays_of("cost", self.cost, ("steps", *COSTS)) | arrays_of("tally", self.tally, Tally._fields)
        state |= arrays_of("tools", self.drive.tools, MOVING) | arrays_of("touch", self.drive.touch, TOUCHING)
        state |= prefixed("rows", columns(self.rows)) | prefixed("energies", columns(self.energy_rows))
        state |= prefixed("contacts", columns(self.contact_rows)) | arrays_of("run", self, ("tool_force", "tool_rows"))
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
        self.model.restore(under(state, "model"))
        put_back(state, "tally", self.tally, Tally._fields)
        put_back(state, "tools", self.drive.tools, MOVING)
        put_back(state, "touch", self.drive.touch, TOUCHING)
        for name in SCALARS:
            setattr(self, name, float(entry(state, f"run/{name}", ())))
        self.dt = self.first_step * self.step_share
        self.start_energy = entry(state, "run/start_energy", self.start_energy.shape)
        for name in COSTS:
            setattr(self.cost, name, float(entry(state, f"cost/{name}", ())))
        self.row_steps, self.cost.steps = int(entry(state, "run/row_steps", ())), int(entry(state, "cost/steps", ()))
        self.rows, self.energy_rows = rows_of(under(state, "rows")), rows_of(under(state, "energies"))
        self.contact_rows = rows_of(under(state, "contacts"))
        self.tool_force = entry(state, "run/tool_force", self.tool_force.shape)
        self.tool_rows = int(entry(state, "run/tool_rows", ()))
        self.samples = list(zip(entry(state, "samples/time").tolist(), entry(state, "samples/reaction"), strict=True))
        self.frames = [frame_of(f) for f in snapshot.frames]
        if "rest" in state:
            self.rest = Rest(**json.loads(str(state["rest"])))
        if "at_peak/time" in state:
            time, coordinate, force = (float(entry(state, f"at_peak/{name}", ())) for name in FRAME)
            place = entry(state, "at_peak/position", self.model.nodes.position.shape)
            self.at_peak = Kept(time, coordinate, force, place)


def frame_state(frame: Frame) -> State:
    """A frame as arrays."""
    state = {f"frame/{name}": np.asarray(getattr(frame, name)) for name in (*FRAME, "position")}
    return state | prefixed("field", frame.fields)


def frame_of(state: State) -> Frame:
    """Frame that :func:`frame_state` was made of."""
    time, coordinate, force = (float(entry(state, f"frame/{name}", ())) for name in FRAME)
    return Frame(time, coordinate, force, entry(state, "frame/position"), under(state, "field"))
