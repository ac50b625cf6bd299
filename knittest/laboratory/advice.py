"""Advice of a refusal: the setting to change, of shells with a number derived from the run, and the rule behind it."""

from collections.abc import Callable
from math import isfinite, sqrt
from typing import NamedTuple

from knittest.base.kinds import kinds
from knittest.base.rest import Rest
from knittest.base.rounding import rounded_down
from knittest.config.run import Run

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
