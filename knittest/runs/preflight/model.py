"""Model of a run before it starts: sizes, masses, time step, memory, initial overlap, speed, run time."""

import time as clock
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, cast

from knittest.base.errors import NumericalError
from knittest.base.history import OVERLAP_COUNTS
from knittest.base.kinds import kinds
from knittest.config.fabric import Fabric
from knittest.config.loading import DIRECTIONS, other_direction_fields, rig_default_paths, rig_default_value
from knittest.config.run import Run
from knittest.config.sources import parameter_set_text
from knittest.config.suspicious_values import find_suspicious_values
from knittest.kernels.threading import limit_threads
from knittest.laboratory.base import PreparedSpecimen, StaticMount
from knittest.laboratory.halved_setting import changes, halve_setting
from knittest.laboratory.report_base import TESTS
from knittest.laboratory.restart import SPEED, has_configured_speed, with_result_speed
from knittest.models.boundary import Boundary
from knittest.report_page.parameters import unit_of
from knittest.runs.specimen import run_specimen, threads_for
from knittest.solve.compilation import load_kernels, missing_kernels
from knittest.solve.simulation import MOUNTING, simulate
from knittest.solve.state import Observer, Rig

#: approximate bytes per node in all arrays
BYTES_PER_NODE = 900
#: units by the last part of the name of a fact
FACT_UNITS = {"mm": "mm", "mm2": "mm2", "pct": "%"}


def model_facts(run: Run, prepared: PreparedSpecimen) -> dict[str, Any]:
    """Numbers of the ``prepared`` model of ``run``, with units in their names; overlaps for the meso scale."""
    model = prepared.model
    overlaps = model.prepare()
    step = run.solver.safety * model.critical_step
    mass = float(model.mass.sum())
    facts = {
        "fabric": run.fabric.name,
        "parameters": run.parameters,
        "test": run.rig.kind,
        "direction": run.direction,
        "scale": run.model.scale,
        "preset": run.model.preset,
        "specimen": prepared.facts,
        "elements": len(model.mesh.cells),
        "nodes": model.n_nodes,
        "mass_g": mass,
        "area_mass_g_m2": 1e6 * mass / prepared.facts["area_mm2"],
        "time_step_us": 1e3 * step,
        "added_mass_pct": 100.0 * model.added_mass,
        "steps_at_most": int(prepared.duration / step),
        "duration_ms": prepared.duration,
        "arrays_mb": model.n_nodes * BYTES_PER_NODE / 1e6,
        "notes": [*prepared.notes, *find_suspicious_values(run)],
    }
    if run.model.scale == "meso":
        facts |= {
            "overlap_pct": 100.0 * overlaps.largest, "overlapping_contacts": overlaps.count,
            "worst_overlaps": list(overlaps.worst),
        }  # fmt: skip
    return facts


def model_lines(run: Run, facts: Mapping[str, Any]) -> list[str]:
    """:func:`model_facts` as lines for a user."""
    what = " ".join(part for part in (facts["test"], facts["direction"]) if part)
    specimen = ", ".join(_fact_text(name, value) for name, value in facts["specimen"].items())
    given = run.fabric.area_mass
    lines = [
        f"{facts['fabric']} ({parameter_set_text(facts['parameters'])}), {what}, {facts['scale']}, {facts['preset']}",
        f"  specimen               {specimen}",
        f"  elements, nodes        {facts['elements']}, {facts['nodes']}",
        f"  mass                   {facts['mass_g']:.3f} g, {facts['area_mass_g_m2']:.0f} g/m2 ({given.source} "
        f"{given.value:g} g/m2)",
        f"  time step              {facts['time_step_us']:.4f} us, added mass {facts['added_mass_pct']:.2f} %",
        f"  steps (maximum)        {facts['steps_at_most']} ({facts['duration_ms']:.2f} ms of test)",
        f"  memory                 about {max(facts['arrays_mb'], 1.0):.0f} MB of arrays",
    ]
    if "overlap_pct" in facts:
        lines.append(
            f"  initial yarn overlap   {facts['overlap_pct']:.2f} % of the yarn radius; "
            f"{facts['overlapping_contacts']} contacts above {100.0 * OVERLAP_COUNTS:g} %"
        )
        lines += [f"    {pair}" for pair in facts["worst_overlaps"]]
    return [*lines, *(f"  note                   {note}" for note in facts["notes"])]


def _fact_text(name: str, value: float) -> str:
    """Fact of a specimen with the unit at the end of its ``name``: ``width 50 mm``."""
    label, _, last = name.rpartition("_")
    unit = FACT_UNITS.get(last)
    return f"{(label if unit else name).replace('_', ' ')} {value:g} {unit or ''}".rstrip()


def rigs_of(fabric: Fabric) -> list[dict[str, Any]]:
    """Rig settings of the fabric file by test and direction; ``assumed`` are taken from the other direction."""
    found = []
    for kind in fabric.rigs:
        for direction in DIRECTIONS if kinds()[kind].directional else ("",):
            fields = rig_default_paths(fabric.rigs[kind], kind, direction)
            values = {name: rig_default_value(fabric, kind, at) for name, at in fields.items()}
            assumed = other_direction_fields(fabric, kind, direction)
            found.append({"test": kind, "direction": direction, "fields": values, "assumed": assumed})
    return found


def rig_lines(fabric: Fabric) -> list[str]:
    """:func:`rigs_of` as lines for a user; none for a fabric without rig settings."""
    lines = []
    for rig in rigs_of(fabric):
        fields, assumed = rig["fields"], rig["assumed"]
        values = ", ".join(f"{name} {value:g}{unit_of(('rig', name), rig['test'])}" for name, value in fields.items())
        others = " and ".join(dict.fromkeys(assumed.values()))
        which = "" if len(assumed) == len(fields) else f" ({', '.join(assumed)})"
        why = f"; assumed{which}: as {others}, the only direction tested" if assumed else ""
        lines.append(f"  {' '.join(filter(None, (rig['test'], rig['direction'])))}: {values}{why}")
    return ["rig settings of the fabric file (--set rig.NAME=... overrides them)", *lines] if lines else []


def speed_study(run: Run) -> tuple[list[str], bool]:
    """Lines on the results of ``run`` at full and half speed, and whether the first result is converged."""
    fast = run_specimen(run).results
    study = halve_setting(with_result_speed(run, fast))
    slow = run_specimen(study.half).results
    if not has_configured_speed(study.half, slow):
        raise NumericalError(f"{study.setting} {0.5 * study.value:g}: restarted at a lower speed, so not comparable")
    found = changes(fast, slow)
    heads = [f"{value:g} {study.unit}".removesuffix(" -") for value in (study.value, 0.5 * study.value)]
    lines = [f"  {study.setting:<34}{heads[0]:>14}{heads[1]:>14}    change"]
    lines += [f"  {n:<34}{fast[n]:>14.5g}{slow[n]:>14.5g}{100.0 * found[n]:>+9.2f} %" for n in fast if n != SPEED]
    first, limit = next(iter(found)), kinds()[run.rig.kind].converged
    passed = abs(found[first]) < limit
    lines.append(f"  {first}: {'within' if passed else 'NOT within'} {100.0 * limit:g} %")
    return lines, passed


#: least steps and seconds that are timed, and seconds after which timing ends
STEPS, SECONDS, ENOUGH = 100, 0.5, 10.0


#: mean time per step of a meso test over that of its first steps, to failure and else: contacts of yarns that move are
#: searched more often. Measured: 1.8 to 1.9 (tensile), 1.4 (biaxial), 1.5 (picture frame), 1.0 (friction, pull-out)
TO_FAILURE, ELSE = 1.8, 1.15
#: seconds of a run besides its specimens: program start and results; pictures and report
PROGRAM, OUTPUT = 2.0, 2.0


@dataclass(frozen=True)
class Estimate:
    """Numbers of steps and seconds per timed step; ``growth`` is the mean time per step over that of the timed ones.

    Before its test each specimen takes ``preparation_s`` and ``rest_s`` for its geometry and its initial equilibrium,
    and up to ``mounting_steps`` of relaxation after its mounting. ``compiled_s`` was spent on kernels, once.
    ``may_restart``: the test restarts at a lower speed if an energy ratio exceeds its limit.
    """

    steps_expected: int
    steps_at_most: int
    seconds_per_step: float
    steps_timed: int
    threads: int
    specimens: int
    preparation_s: float
    rest_s: float = 0.0
    mounting_steps: int = 0
    growth: float = 1.0
    compiled_s: float = 0.0
    may_restart: bool = False

    @property
    def stages(self) -> dict[str, float]:
        """Seconds of the stages of one specimen."""
        return {
            "geometry": self.preparation_s,
            "initial equilibrium": self.rest_s,
            "relaxation after mounting": self.mounting_steps * self.seconds_per_step,
            "test": self.steps_expected * self.seconds_per_step * self.growth,
        }

    @property
    def specimens_s(self) -> float:
        """Seconds for all specimens, one after the other."""
        return self.specimens * sum(self.stages.values())

    @property
    def seconds(self) -> float:
        """Seconds for all specimens, program start, results, pictures and report."""
        return self.specimens_s + PROGRAM + OUTPUT

    def text(self) -> str:
        """Estimate with its stages."""
        growth = f" x {self.growth:g}" if self.growth != 1.0 else ""
        steps = {
            "relaxation after mounting": f" (at most {self.mounting_steps} steps)",
            "test": f" ({self.steps_expected} steps of {1e3 * self.seconds_per_step:.3g} ms{growth}, "
            f"from {self.steps_timed} steps)",
        }
        each = ", ".join(
            f"{name} {duration_text(seconds)}{steps.get(name, '')}"
            for name, seconds in self.stages.items()
            if seconds > 0.0
        )
        several = f"{self.specimens} specimens x ({each})" if self.specimens > 1 else each
        threads = f"{self.threads} thread{'s' * (self.threads > 1)}"
        return (
            f"about {duration_text(self.seconds)} on {threads}: {several}, program start, pictures and report "
            f"{duration_text(PROGRAM + OUTPUT)}"
            + ("; a restart at a lower speed comes on top" if self.may_restart else "")
            + (f"; kernels: {duration_text(self.compiled_s)}, now in the cache" if self.compiled_s else "")
        )

    def as_json(self) -> dict[str, object]:
        """All numbers, for a program."""
        return {"seconds": self.seconds, **asdict(self), "stages": self.stages}


class _TimedRig:
    """The ``rig``, which ends as soon as enough steps are timed; ``times`` are those of its samples."""

    def __init__(self, rig: Rig) -> None:
        self._rig = rig
        self.mounted_at, self.locks = 0.0, False  # a mounting takes as long a step as the test
        self.times: list[tuple[float, float]] = []  # simulated [ms], clock [s]

    def __getattr__(self, name: str) -> Any:
        return getattr(self._rig, name)

    def constrain(self, boundary: Boundary) -> None:
        self._rig.constrain(boundary)
        self.step = boundary.dt

    def is_finished(self, force: float, peak: float, broken: bool) -> bool:
        """Tell whether the test has ended, or enough steps and seconds are timed."""
        if len(self.times) < 2 or self._rig.is_finished(force, peak, broken):
            return len(self.times) >= 2
        spent = self.times[-1][1] - self.times[0][1]
        return spent >= ENOUGH or (self.timed >= STEPS and spent >= SECONDS)

    @property
    def timed(self) -> int:
        """Steps between the first sample and the last one."""
        return round((self.times[-1][0] - self.times[0][0]) / self.step)

    @property
    def step_s(self) -> float:
        """Seconds per timed step."""
        return (self.times[-1][1] - self.times[0][1]) / max(self.timed, 1)

    def before(self, start: float) -> float:
        """Wall time [s] from ``start`` to the first step."""
        simulated, sampled = self.times[0]
        return max(sampled - start - simulated / self.step * self.step_s, 0.0)


class _Stopwatch(Observer):
    """Stores simulated time [ms] and clock [s] of each sample in ``times``."""

    def __init__(self, times: list[tuple[float, float]]) -> None:
        self._times = times

    def progress(self, fraction: float, time_ms: float, step_us: float, kinetic_ratio: float) -> None:
        """Store a sample."""
        self._times.append((time_ms, clock.perf_counter()))


def estimate(run: Run, prepared: PreparedSpecimen, prepared_s: float = 0.0) -> Estimate | None:
    """Time the first steps of ``prepared``, the model of ``run``; None for a test that ends in static equilibrium.

    Compiles what the run needs; ``prepared_s`` [s] is the time its model took. The model has moved afterwards. Rows are
    at most :data:`STEPS` long, so that timing ends however many steps the run has.
    """
    if isinstance(prepared.mount, StaticMount):
        return None
    threads = threads_for(len(prepared.model.mesh.cells))
    missing = missing_kernels(run, threads)
    loaded_s = load_kernels(run, threads=threads)
    rig = _TimedRig(prepared.rig)
    rows = prepared.rig.duration / (run.solver.safety * prepared.model.critical_step * STEPS)
    output = run.output.model_copy(update={"samples": max(run.output.samples, round(rows))})
    with limit_threads(threads):
        start = clock.perf_counter()
        _, cost = simulate(prepared.model, cast("Rig", rig), run.solver, output, _Stopwatch(rig.times))
    at_most = int(prepared.rig.duration / rig.step)
    meso, test = run.model.scale == "meso", TESTS[run.rig.kind]
    return Estimate(
        steps_expected=round(at_most * expected_share(run, prepared)), steps_at_most=at_most,
        seconds_per_step=rig.step_s, steps_timed=rig.timed, threads=cost.threads or threads,
        specimens=run.variability.specimens, preparation_s=prepared_s, rest_s=rig.before(start),
        mounting_steps=MOUNTING if prepared.rig.mounted_at > 0.0 else 0,
        growth=(TO_FAILURE if test.ends_at_failure else ELSE) if meso and not kinds()[run.rig.kind].periodic else 1.0,
        compiled_s=loaded_s if missing else 0.0, may_restart=meso and test.lowers_speed,
    )  # fmt: skip


def expected_share(run: Run, prepared: PreparedSpecimen) -> float:
    """Share of the rig's motion at which the specimen is expected to fail; 1 without failure."""
    kind = kinds()[run.rig.kind]
    return float(kind.load("lasting")(run, prepared)) if kind.lasting else 1.0


def duration_text(seconds: float) -> str:
    """Duration with two digits, in seconds, minutes or hours."""
    if seconds < 90.0:
        return f"{seconds:.2g} s"
    return f"{seconds / 60.0:.2g} min" if seconds < 5400.0 else f"{seconds / 3600.0:.2g} h"
