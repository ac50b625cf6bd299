"""Quality checks of a run that was integrated in time, the part of it that they cover, and advice where one fails."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from math import isfinite, sqrt
from typing import NamedTuple

import numpy as np

from knittest.base.history import Array, History, Quality, Rest, judged_rows
from knittest.base.kinds import kinds
from knittest.base.units import rounded_down
from knittest.config.gates import LEAST_ROWS, NEAR, SolverGate, gates_of
from knittest.config.run import Run
from knittest.laboratory.base import Prepared
from knittest.laboratory.law_end import BeyondLaw, beyond_law
from knittest.solve.simulate import LOCKED
from knittest.solve.state import SimulationCost

#: share of its limit that advice aims at, as the rules are estimates
AIM = 0.7


def advised(run: Run, key: str, value: float, limit: float, rest: Rest | None = None) -> str:
    """Setting that would bring the gate ``key`` from ``value`` to :data:`AIM` of its ``limit``, both [%].

    Of yarns only the field is named: nobody verified the rules there. Empty where no setting of the run decides, or
    nothing is known of the value. Where loops at ``rest`` wrap each other so closely that they snap, speed and step do
    not decide, and what does is said.
    """
    if rest is not None and rest.advice and key in OF_SNAPPING:
        return rest.advice
    kind = kinds()[run.rig.kind]
    rule = (RULES | (kind.load("advice") if kind.advice else {})).get(key)
    if rule is None or not isfinite(value):
        return ""
    aim = AIM * limit
    share = aim / value
    if key in OF_THE_WORK and value < 100.0:  # the loss is a part of the work, which shrinks with it
        share = aim * (100.0 - value) / (value * (100.0 - aim))
    found = rule(run, share)
    return found if isinstance(found, str) else found.advice(run.model.scale)


class Setting(NamedTuple):
    """A field with its value in a run and the one that a rule gives, why, and what is known of the latter."""

    why: str
    field: str
    now: float
    value: float
    known: str = "{} would pass"

    def advice(self, scale: str) -> str:
        """Text with the value where the rule was verified, which is on shells; of yarns with the present one."""
        if scale == "macro":
            return f"{self.why}: {self.known.format(f'{self.field}={self.value:g}')}"
        return f"{self.why}: {'lower' if self.value < self.now else 'raise'} {self.field}, which is {self.now:g}"


def _slower(run: Run, share: float) -> Setting:
    speed = run.solver.speed
    return Setting("it goes with the square of the speed", "solver.speed", speed, rounded_down(speed * sqrt(share)))


def _slower_contacts(run: Run, share: float) -> Setting:
    speed = run.solver.speed
    return Setting("it falls with the speed", "solver.speed", speed, rounded_down(speed * share), "try {}")


def _smaller_step(run: Run, share: float) -> Setting:
    """Measured on strips and frames of shells: an error of the order of the step, not of its square."""
    safety = run.solver.safety
    return Setting("it goes with the step", "solver.safety", safety, rounded_down(safety * share))


def _stiffer_contacts(run: Run, share: float) -> Setting | str:
    """Penalties of shells grow with the inverse square of the step; that of yarns is a field of the fabric."""
    if run.model.scale == "macro":
        safety = run.solver.safety
        why = "it goes with the square of the step"
        return Setting(why, "solver.safety", safety, rounded_down(safety * sqrt(share)))
    if run.fabric.contact is None:
        return ""
    stiffness = run.fabric.contact.normal_stiffness_n_per_mm
    why = "it goes with the inverse of the stiffness"
    return Setting(why, "fabric.contact.normal_stiffness", stiffness, stiffness / share)


def _less_damping(run: Run, share: float) -> Setting:
    damping = run.solver.damping
    return Setting("it goes with the damping", "solver.damping", damping, rounded_down(damping * share))


def finer_shells(run: Run, share: float) -> Setting:
    """Element size [mm] that would bring what falls with it to ``share`` of itself."""
    size = run.model.macro.element_size
    why = "it falls with the size of the shells"
    return Setting(why, "model.macro.element_size", size, rounded_down(size * share), "try {}")


#: what loops that snap are refused by
OF_SNAPPING = ("ke_over_ie_max", "energy_error_max", "damping_over_work_max", "contact_damping_over_work_max")
OF_THE_WORK = ("damping_over_work_max", "contact_damping_over_work_max")
RULES: dict[str, Callable[[Run, float], Setting | str]] = {
    "ke_over_ie_max": _slower,
    "energy_error_max": _smaller_step,
    "damping_over_work_max": _less_damping,
    "contact_damping_over_work_max": _slower_contacts,
    "hourglass_over_internal_max": finer_shells,
    "penetration_over_radius_max": _stiffer_contacts,
}


@dataclass(frozen=True)
class Span:
    """Part of a test that is judged: to the first failure or to the end; its first number is ``reported_from`` [ms]."""

    to_failure: bool = False
    reported_from: float = np.inf

    def rows(self, history: History) -> slice:
        """Rows of the energies."""
        return judged_rows(history, to_failure=self.to_failure, reported_from=self.reported_from)


#: share of the work up to the largest force that must be done before the first failure, as nothing after it is judged
BEFORE_FAILURE = 0.25
#: overlap without force, away from the ends of yarns and at them
FORCE_FREE = ("force_free_overlap_max_pct", "force_free_at_ends_max_pct")
#: angle [deg] by which the last row of a shear test may lie before its end
LAG = 0.5
#: overlap [% of the smaller radius] at which a contact was found late, above which a run warns: one centre-line is
#: beyond the other's surface
LATE = 100.0


def assess(
    run: Run, prepared: Prepared, history: History, cost: SimulationCost, span: Span, drag: float = 0.0
) -> Quality:
    """Judge by inertia, losses, energy balance, contacts, added mass and the end of the law; ``drag`` is forming's.

    What is not a number fails. A test to failure in which nothing fails inside its strain range is refused too.
    """
    rows = span.rows(history)
    damping, contact_damping, hourglass = (float(share[rows].max()) for share in losses(history.energies))
    beyond = beyond_law(run, history, span.to_failure)
    quality = Quality(
        ke_over_ie_max=float(history.energies["kinetic_ratio"][rows].max()),
        energy_error_max=float(history.energies["energy_error"][rows].max()),
        penetration_over_radius_max=_penetration(history, cost, span),
        penetration_over_radius_mean=cost.penetration_mean,
        added_mass_pct=100.0 * prepared.model.added_mass,
        quasi_static=True,
        failures=tuple(_short(run, prepared, history, cost, span)),
        overlap_at_start=history.overlaps.largest,
        force_free_overlap_max=_force_free(history, rows),
        damping_over_work_max=damping,
        contact_damping_over_work_max=contact_damping,
        hourglass_over_internal_max=hourglass,
        beyond_law=beyond.share,
        drag_over_weight=drag,
    )
    late = float(history.contacts.get("found_late_max_pct", np.zeros(0))[: rows.stop].max(initial=0.0))
    if late > LATE:
        quality = quality.warning(
            f"a contact of yarns was found late, at an overlap of {late:.0f} % of a radius; above {LATE:g} % yarns may "
            "have passed each other: compare with a smaller solver.safety"
        )
    return _judged(run, quality, beyond, history.rest)


def losses(energies: dict[str, Array]) -> tuple[Array, Array, Array]:
    """Damping and contact damping over the work, hourglass over the internal energy [-], (n_rows,).

    Over the largest so far: a frame that turns gives some of both back. Energy that was given to contacts found late
    counts with the damping of contacts.
    """
    work = np.maximum.accumulate(np.abs(energies["external_mj"]))
    internal = np.sum([values for name, values in energies.items() if name.startswith("internal_")], axis=0)
    return (
        _share(energies["damping_mj"], work),
        _share(energies["contact_damping_mj"] + energies.get("contact_recovery_mj", 0.0), work),
        _share(energies["hourglass_mj"], np.maximum.accumulate(np.maximum(internal, 0.0))),
    )


def _share(part: Array, whole: Array) -> Array:
    """``part`` over ``whole``; of nothing an infinite one, unless it is nothing itself."""
    with np.errstate(divide="ignore", invalid="ignore"):
        share: Array = np.where((part == 0.0) & (whole == 0.0), 0.0, part / whole)
    return share


def locking(history: History, most: float) -> tuple[str, ...]:
    """Say at which angle a shear test ended before ``most`` [deg], as its yarns locked; nothing where it did not."""
    angle = next(values for name, values in history.curve.items() if name.endswith("shear_angle_deg"))
    reached = float(angle.max())
    if reached > most - LAG:
        return ()
    return (
        f"the fabric locks at {reached:.1f} deg: yarns press into each other with {100.0 * LOCKED:g} % of the work; "
        f"the test ends there, before {most:g} deg",
    )


def _penetration(history: History, cost: SimulationCost, span: Span) -> float:
    """Largest penetration over radius: before the first failure, which ends some tests, or of all samples."""
    found = cost.penetration_max
    if not span.to_failure and "penetration_max_pct" in history.contacts:
        found = max(found, 0.01 * float(history.contacts["penetration_max_pct"].max(initial=0.0)))
    return found


def _force_free(history: History, rows: slice) -> float:
    """Deepest overlap of yarns that carries no force over the smaller radius, up to the end of what is judged.

    An overlap at cut ends counts. One that is seen in a single row does not: a contact that was found late gets its
    force within a few rows, and its energy is judged with the damping of contacts.
    """
    columns = [history.contacts.get(name, np.zeros(0))[: rows.stop] for name in FORCE_FREE]
    lasting = [np.minimum(found, np.append(found[1:], found[-1:])) for found in columns]
    return 0.01 * float(np.concatenate(lasting).max(initial=0.0))


def _short(run: Run, prepared: Prepared, history: History, cost: SimulationCost, span: Span) -> Iterator[str]:
    """Reasons why a judgement is empty: no failure, too few rows, a first failure long before the peak."""
    rows = span.rows(history)
    if span.to_failure and history.first_failure is None:
        yield "nothing failed up to rig.max_strain: the peak is not a strength"
    count = rows.stop - rows.start
    if count < LEAST_ROWS:
        yield (
            f"{count} rows of energies lie between start-up and the end of what is judged, {LEAST_ROWS} are needed: "
            f"{_more_rows(run, prepared, history, cost, rows)} gives enough"
        )
    if span.to_failure and history.first_failure is not None:
        work, times = np.abs(history.energies["external_mj"]), history.energies["time_ms"]
        peak = history.curve["time_ms"][int(np.argmax(history.curve["force_n"]))]
        at_peak = float(np.interp(peak, times, work))
        if not work[rows.stop - 1] >= BEFORE_FAILURE * at_peak:
            yield (
                f"the first failure comes at {100.0 * work[rows.stop - 1] / at_peak:.0f} % of the work at the largest "
                f"force, and energies are judged up to it: {100.0 * BEFORE_FAILURE:g} % are needed"
            )


def _more_rows(run: Run, prepared: Prepared, history: History, cost: SimulationCost, rows: slice) -> str:
    """Setting that gives half as many rows again as are needed.

    Rows are no closer than a chunk of steps: where that is too far, the test must take longer. While the rig starts up,
    its way grows with the square of the time, and the time to a given way with the inverse root of the speed only.
    """
    times, duration = history.energies["time_ms"], prepared.duration
    judged = times[rows.stop - 1] - (times[rows.start - 1] if rows.start else 0.0)
    samples = int(np.ceil(1.5 * LEAST_ROWS * duration / judged))
    most = duration / (prepared.model.chunk * cost.time_step)
    if samples <= most:
        return f"--set output.samples={samples}"
    power = 2.0 if times[rows.stop - 1] <= run.solver.ramp_ms else 1.0
    slower = f"--set solver.speed={rounded_down(run.solver.speed * (most / samples) ** power):g}"
    return slower if samples <= run.output.samples else f"{slower} --set output.samples={samples}"


def _judged(run: Run, quality: Quality, beyond: BeyondLaw, rest: Rest | None) -> Quality:
    for gate in gates_of(run):
        if gate.key == "beyond_law" and 0.0 < gate.value(quality) <= run.solver.max_beyond_law:
            quality = quality.warning(beyond.stated)
        else:
            quality = by_gate(run, quality, gate, beyond, rest)
    quality = quality.warning(*(rest.warnings if rest else ()))
    return replace(quality, quasi_static=100.0 * quality.ke_over_ie_max <= run.solver.max_kinetic_ratio)


def by_gate(
    run: Run, quality: Quality, gate: SolverGate, beyond: BeyondLaw | None = None, rest: Rest | None = None
) -> Quality:
    """``quality`` refused where it does not pass ``gate``, with a warning above half of its limit; advice goes by the
    state of ``rest`` too.
    """
    value, limit = gate.value(quality), float(getattr(run.solver, gate.limit))
    if value <= limit:
        near = f"{gate.label} {value:.2f} % is more than half of its limit {limit:g} %"
        return quality.warning(near) if value > NEAR * limit else quality
    said = f"{gate.label} is not a number" if np.isnan(value) else f"{gate.label} {value:.2f} % is above {limit:g} %"
    of_law = beyond if gate.key == "beyond_law" else None
    advice = of_law.advice(run) if of_law else advised(run, gate.key, value, limit, rest)
    heard = any(advice in before for before in quality.failures)  # loops that wrap are the cause of several
    return quality.refusing(said if heard or not advice else f"{said}; {advice}")
