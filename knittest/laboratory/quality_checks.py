"""Quality checks of a run that was integrated in time, the span that they cover, and advice where one fails."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from math import ceil, isfinite
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from knittest.base.history import Array, History, InitialEquilibrium, Quality, checked_rows
from knittest.base.kinds import kinds
from knittest.base.units import round_down
from knittest.config.quality_checks import LEAST_ROWS, NEAR, SolverCheck, quality_checks_of
from knittest.config.run import Run
from knittest.laboratory.base import PreparedSpecimen
from knittest.laboratory.shear_law_end import LawExcess, TableExcess, find_law_excess
from knittest.models.contact_tracker import LEAST_STEPS, SMALL_PORTION
from knittest.solve.state import LOCKED, SimulationCost

#: least work [mJ] in a ratio
LEAST_WORK = 1e-9
#: share of its limit that advice aims at, as the rules are estimates
TARGET_SHARE = 0.7


class SuggestedSetting(NamedTuple):
    """A field with its present value and the one that a rule gives, why, and whether that value was verified."""

    why: str
    field: str
    now: float
    value: float
    known: str = "rerun with --set {}"

    def advice(self, scale: str) -> str:
        """Text with the value of a macro model, where rules were verified; of a meso model with the present value."""
        if scale == "macro":
            return f"{self.why}: {self.known.format(f'{self.field}={self.value:g}')}"
        return f"{self.why}: {'lower' if self.value < self.now else 'raise'} {self.field} (now {self.now:g})"


TRY_TEXT = "try --set {}"


def _solver_rule(why: str, field: str, power: float, known: str = "rerun with --set {}") -> "Rule":
    """Rule for a ratio that grows with the inverse of ``power`` of a field of the solver."""

    def rule(run: Run, share: float) -> SuggestedSetting:
        now = getattr(run.solver, field)
        return SuggestedSetting(why, f"solver.{field}", now, round_down(now * share**power), known)

    return rule


def _advise_stiffer_contact(run: Run, share: float) -> SuggestedSetting | str:
    """Penalties of shells grow with the inverse square of the step; that of yarns is a field of the fabric."""
    if run.model.scale == "macro":
        return _solver_rule("it grows with the square of the time step", "safety", 0.5)(run, share)
    if run.fabric.contact is None:
        return ""
    stiffness = run.fabric.contact.normal_stiffness_n_per_mm
    why = "it falls with the contact stiffness"
    return SuggestedSetting(why, "fabric.contact.normal_stiffness", stiffness, stiffness / share)


def advise_finer_shells(run: Run, share: float) -> SuggestedSetting:
    """Element size [mm] that would reduce a ratio to ``share`` of itself."""
    size = run.model.macro.element_size
    why = "it falls with the element size"
    return SuggestedSetting(why, "model.macro.element_size", size, round_down(size * share), TRY_TEXT)


#: checks that fail where loops snap
SNAP_THROUGH_CHECKS = ("ke_over_ie_max", "energy_error_max", "damping_over_work_max", "contact_damping_over_work_max")
WORK_SHARES = ("damping_over_work_max", "contact_damping_over_work_max")
Rule = Callable[[Run, float], SuggestedSetting | str]
#: the energy error was measured on strips and frames of shells: it is of the order of the step, not of its square
RULES: dict[str, Rule] = {
    "ke_over_ie_max": _solver_rule("it grows with the square of the speed", "speed", 0.5),
    "energy_error_max": _solver_rule("it grows with the time step", "safety", 1.0),
    "damping_over_work_max": _solver_rule("it grows with the damping", "damping", 1.0),
    "contact_damping_over_work_max": _solver_rule("it grows with the speed", "speed", 1.0, TRY_TEXT),
    "hourglass_over_internal_max": advise_finer_shells,
    "penetration_over_radius_max": _advise_stiffer_contact,
}


def advice_for(run: Run, key: str, value: float, limit: float, rest: InitialEquilibrium | None = None) -> str:
    """Setting that would reduce the check ``key`` from ``value`` to :data:`TARGET_SHARE` of its ``limit``, both [%].

    Empty if it is unknown.

    A meso run gets the field alone, as rules were not verified there. For loops that snap it is the advice of ``rest``.
    """
    if rest is not None and rest.advice and key in SNAP_THROUGH_CHECKS:
        return rest.advice
    kind = kinds()[run.rig.kind]
    rule = (RULES | (kind.load("advice") if kind.advice else {})).get(key)
    if rule is None or not isfinite(value):
        return ""
    aim = TARGET_SHARE * limit
    share = aim / value
    if key in WORK_SHARES and value < 100.0:  # the loss is a part of the work, which shrinks with it
        share = aim * (100.0 - value) / (value * (100.0 - aim))
    found = rule(run, share)
    return found if isinstance(found, str) else found.advice(run.model.scale)


@dataclass(frozen=True)
class Span:
    """Part of a test that is checked: up to the first failure or the end; results begin at ``reported_from`` [ms]."""

    to_failure: bool = False
    reported_from: float = np.inf

    @classmethod
    def from_value(cls, history: History, column: str, least: float) -> "Span":
        """Span from the first row in which ``column`` of the curve is at least ``least``."""
        first = history.curve[column] >= least
        return cls(reported_from=float(history.curve["time_ms"][np.argmax(first)]) if first.any() else np.inf)

    def rows(self, history: History) -> slice:
        """Rows of the energies."""
        return checked_rows(history, to_failure=self.to_failure, reported_from=self.reported_from)


#: share of the work up to the largest force that must be done before the first failure, as nothing after it is checked
BEFORE_FAILURE = 0.25
#: overlap without force, away from the ends of yarns and at them
FORCE_FREE = ("force_free_overlap_max_pct", "force_free_at_ends_max_pct")
#: angle [deg] or strain [%] by which the last row of a test may lie before its end
LAG = 0.5
#: overlap [% of the smaller radius] of a contact found late above which a run warns: a centre line is past the surface
LATE_OVERLAP = 100.0


def assess(
    run: Run, prepared: PreparedSpecimen, history: History, cost: SimulationCost, span: Span, drag: float = 0.0
) -> Quality:
    """Evaluate the quality checks of ``span``; ``drag`` is forming's. A value that is not a number fails."""
    rows = span.rows(history)
    damping, contact_damping, hourglass = (float(share[rows].max()) for share in loss_ratios(history.energies))
    beyond, penetration = find_law_excess(run, history, span.to_failure), cost.penetration_max
    if not span.to_failure and "penetration_max_pct" in history.contacts:
        penetration = max(penetration, 0.01 * float(history.contacts["penetration_max_pct"].max(initial=0.0)))
    free = [history.contacts.get(name, np.zeros(0))[: rows.stop] for name in FORCE_FREE]
    lasting = [_lasting_overlap(found, _recovery_rows(run, prepared, history, cost)) for found in free]
    quality = Quality(
        ke_over_ie_max=float(kinetic_ratios(run, history.energies)[rows].max()),
        energy_error_max=float(history.energies["energy_error"][rows].max()),
        penetration_over_radius_max=penetration,
        penetration_over_radius_mean=cost.penetration_mean,
        added_mass_pct=100.0 * prepared.model.added_mass,
        quasi_static=True,
        failures=tuple(_span_problems(run, prepared, history, cost, span)),
        overlap_at_start=history.overlaps.largest,
        force_free_overlap_max=0.01 * float(np.concatenate(lasting).max(initial=0.0)),
        damping_over_work_max=damping,
        contact_damping_over_work_max=contact_damping,
        hourglass_over_internal_max=hourglass,
        beyond_law=beyond.share,
        drag_over_weight=drag,
    )
    late = float(history.contacts.get("found_late_max_pct", np.zeros(0))[: rows.stop].max(initial=0.0))
    if late > LATE_OVERLAP:
        quality = quality.with_warnings(
            f"a yarn contact was found late, at an overlap of {late:.0f} % of the radius; above "
            f"{LATE_OVERLAP:g} % yarns may "
            "have crossed: compare with a smaller solver.safety"
        )
    for check in quality_checks_of(run):
        if check.key == "beyond_law" and 0.0 < check.value(quality) <= run.solver.max_law_extrapolation:
            quality = quality.with_warnings(beyond.stated)
        else:
            quality = evaluate_check(run, quality, check, beyond, history.rest)
    quality = quality.with_warnings(*(history.rest.warnings if history.rest else ()))
    return replace(quality, quasi_static=100.0 * quality.ke_over_ie_max <= run.solver.max_kinetic_ratio)


def _recovery_rows(run: Run, prepared: PreparedSpecimen, history: History, cost: SimulationCost) -> int:
    """Rows in which force-free overlap must be present to count: a contact that was found late gets its force later.

    That takes a few steps, of soft yarns many: :data:`SMALL_PORTION` of the radius in :data:`LEAST_STEPS` steps.
    """
    times = history.energies["time_ms"]
    if not prepared.model.compliant or len(times) < LEAST_ROWS:
        return 2
    steps = 0.01 * run.solver.max_force_free_overlap / SMALL_PORTION * LEAST_STEPS
    return 2 + ceil(steps * cost.time_step / float(np.median(np.diff(times))))


def _lasting_overlap(values: Array, rows: int) -> Array:
    """Least of ``values`` (n,) in each of their rows and the ``rows`` - 1 after it."""
    after = np.append(values, np.repeat(values[-1:], rows - 1))
    return sliding_window_view(after, rows).min(axis=1) if len(values) else values


def check_limit(quality: Quality, value: float, limit: float, text: str, remedy: str = "") -> Quality:
    """``quality``, failed with ``text`` and ``remedy`` where ``value`` is above its ``limit`` [%]."""
    return quality.with_failed_check(f"{text} (limit {limit:g} %){remedy}") if value > limit else quality


#: largest strain of a repeated path whose rows are relaxed, over the strain that it reached
NEXT_STRAIN = 1.2


def _advise_more_rows(run: Run, prepared: PreparedSpecimen, history: History, cost: SimulationCost, rows: slice) -> str:
    """Setting for 1.5 times the needed rows, which are a chunk of steps apart: more samples, or a lower speed; for a
    path whose rows are relaxed a strain near the one that it reached.
    """
    times, duration = history.energies["time_ms"], prepared.duration
    covered = times[rows.stop - 1] - (times[rows.start - 1] if rows.start else 0.0)
    if prepared.rig.relaxed_rows and "strain_pct" in history.curve:  # the number of rows depends on the path alone
        return f"--set rig.max_strain={NEXT_STRAIN * float(history.curve['strain_pct'].max()):.2g}"
    samples = int(np.ceil(1.5 * LEAST_ROWS * duration / covered))
    most = duration / (prepared.model.chunk * cost.time_step)
    if samples <= most:
        return f"--set output.samples={samples}"
    power = 2.0 if times[rows.stop - 1] <= run.solver.ramp_ms else 1.0
    slower = f"--set solver.speed={round_down(run.solver.speed * (most / samples) ** power):g}"
    return slower if samples <= run.output.samples else f"{slower} --set output.samples={samples}"


def kinetic_ratios(run: Run, energies: dict[str, Array]) -> Array:
    """Kinetic energy over the energy spent, (n_rows,); over the largest work where a direction has no inlays.

    Loops that carry the force give energy of their own when they start to move, so that little is spent.
    """
    if run.model.scale == "macro" or run.fabric.has_inlays_both_ways:
        return energies["kinetic_ratio"]
    return energies["kinetic_mj"] / np.maximum(largest_work(energies), LEAST_WORK)


def largest_work(energies: dict[str, Array]) -> Array:
    """Largest work so far [mJ], (n_rows,); of a specimen that is relaxed at each row with the energy that it gave."""
    return np.maximum.accumulate(energies.get("energy_input_mj", np.abs(energies["external_mj"])))


def loss_ratios(energies: dict[str, Array]) -> tuple[Array, Array, Array]:
    """Damping and contact damping over the largest work, hourglass over the largest internal energy, (n_rows,).

    In relaxed rows nothing moves, so that damping bears no force: it is none there.
    """
    work = largest_work(energies)
    internal = np.sum([values for name, values in energies.items() if name.startswith("internal_")], axis=0)
    moving = 0.0 if "relaxation_mj" in energies else 1.0
    contacts = moving * energies["contact_damping_mj"] + energies.get("contact_recovery_mj", 0.0)
    pairs = (
        (moving * energies["damping_mj"], work), (contacts, work),
        (energies["hourglass_mj"], np.maximum.accumulate(np.maximum(internal, 0.0))),
    )  # fmt: skip
    with np.errstate(divide="ignore", invalid="ignore"):  # a part of nothing is infinite, unless it is nothing itself
        first, second, third = (np.where((part == 0.0) & (whole == 0.0), 0.0, part / whole) for part, whole in pairs)
    return first, second, third


def locking_warning(
    history: History, most: float, column: str = "shear_angle_deg", unit: str = "deg", share: float = LOCKED
) -> tuple[str, ...]:
    """Say where a test ended before ``most`` because its yarns locked, by ``column`` of the curve; empty if it did not.

    ``share`` as in :class:`knittest.solve.state.Rig`.
    """
    reached = float(next(values for name, values in history.curve.items() if name.endswith(column)).max())
    if reached > most - LAG:
        return ()
    return (
        f"the fabric locks at {reached:.1f} {unit}: contacts of the yarns store {100.0 * share:g} % of the work. The "
        f"test ends there, before {most:g} {unit}",
    )


def _span_problems(
    run: Run, prepared: PreparedSpecimen, history: History, cost: SimulationCost, span: Span
) -> Iterator[str]:
    """Reasons why the span is not enough: no failure, too few rows, a first failure long before the peak."""
    rows = span.rows(history)
    can_fail = run.model.scale == "meso" or run.fabric.macro.fracture_strain is not None
    if span.to_failure and can_fail and history.first_failure is None and not run.pulls_loops:
        yield "nothing failed up to rig.max_strain, so the peak force is no strength: raise rig.max_strain"
    count = rows.stop - rows.start
    if count < LEAST_ROWS:
        yield (
            f"{count} samples lie between start-up and the end of the quality checks, at least {LEAST_ROWS} are "
            f"needed: rerun with {_advise_more_rows(run, prepared, history, cost, rows)}"
        )
    if span.to_failure and history.first_failure is not None:
        work, times = np.abs(history.energies["external_mj"]), history.energies["time_ms"]
        peak = history.curve["time_ms"][int(np.argmax(history.curve["force_n"]))]
        at_peak = float(np.interp(peak, times, work))
        if not work[rows.stop - 1] >= BEFORE_FAILURE * at_peak:
            yield (
                f"the first failure comes at {100.0 * work[rows.stop - 1] / at_peak:.0f} % of the work up to the peak "
                f"force. The quality checks end there; they need at least {100.0 * BEFORE_FAILURE:g} %"
            )


def evaluate_check(
    run: Run,
    quality: Quality,
    check: SolverCheck,
    beyond: LawExcess | TableExcess | None = None,
    rest: InitialEquilibrium | None = None,
) -> Quality:
    """Evaluate ``check``: a failure of ``quality`` above its limit, with advice, and a warning above half of it."""
    value, limit = check.value(quality), float(getattr(run.solver, check.limit))
    if value <= limit:
        near = f"{check.label} {value:.2f} % is more than half of its limit {limit:g} %"
        return quality.with_warnings(near) if value > NEAR * limit else quality
    failed = (
        f"{check.label} is not a number" if np.isnan(value) else f"{check.label} {value:.2f} % is above {limit:g} %"
    )
    of_law = beyond if check.key == "beyond_law" else None
    advice = of_law.advice(run) if of_law else advice_for(run, check.key, value, limit, rest)
    repeated = any(advice in before for before in quality.failures)  # snapping loops cause several failures
    return quality.with_failed_check(failed if repeated or not advice else f"{failed}; {advice}")
