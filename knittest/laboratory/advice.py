"""Advice of a refusal: the setting to change, with a number derived from the run, and the rule behind it."""

from collections.abc import Callable
from math import isfinite, sqrt

from knittest.base.kinds import kinds
from knittest.base.rest import Rest
from knittest.base.rounding import rounded_down
from knittest.config.run import Run

#: share of its limit that advice aims at, as the rules are estimates
AIM = 0.7


def advised(run: Run, key: str, value: float, limit: float, rest: Rest | None = None) -> str:
    """Setting that would bring the gate ``key`` from ``value`` to :data:`AIM` of its ``limit``, both [%].

    Empty where no setting of the run decides, or nothing is known of the value. Where loops at ``rest`` wrap each other
    so closely that they snap, speed and step do not decide, and what does is said.
    """
    if rest is not None and rest.advice and key in OF_SNAPPING:
        return rest.advice
    kind = kinds()[run.rig.kind]
    rule = (RULES | (kind.load("advice") if kind.advice else {})).get(key)
    if rule is None or not isfinite(value):
        return ""
    aim = AIM * limit
    if key in OF_THE_WORK and value < 100.0:  # the loss is a part of the work, which shrinks with it
        return rule(run, aim * (100.0 - value) / (value * (100.0 - aim)))
    return rule(run, aim / value)


def _slower(run: Run, share: float) -> str:
    speed = rounded_down(run.solver.speed * sqrt(share))
    return f"it goes with the square of the speed: solver.speed={speed:g} would pass"


def _slower_contacts(run: Run, share: float) -> str:
    speed = rounded_down(run.solver.speed * share)
    return f"it falls with the speed: try solver.speed={speed:g}"


def _smaller_step(run: Run, share: float) -> str:
    """Measured on strips and frames of shells: an error of the order of the step, not of its square."""
    return f"it goes with the step: solver.safety={rounded_down(run.solver.safety * share):g} would pass"


def _stiffer_contacts(run: Run, share: float) -> str:
    """Penalties of shells grow with the inverse square of the step; that of yarns is a field of the fabric."""
    if run.model.scale == "macro":
        safety = rounded_down(run.solver.safety * sqrt(share))
        return f"it goes with the square of the step: solver.safety={safety:g} would pass"
    if run.fabric.contact is None:
        return ""
    stiffness = run.fabric.contact.normal_stiffness_n_per_mm / share
    return f"it goes with the inverse of the stiffness: fabric.contact.normal_stiffness={stiffness:.2g} would pass"


def _less_damping(run: Run, share: float) -> str:
    damping = rounded_down(run.solver.damping * share)
    return f"it goes with the damping: solver.damping={damping:g} would pass"


def finer_shells(run: Run, share: float) -> str:
    """Element size [mm] that would bring what falls with it to ``share`` of itself."""
    size = rounded_down(run.model.macro.element_size * share)
    return f"it falls with the size of the shells: try model.macro.element_size={size:g}"


#: what loops that snap are refused by
OF_SNAPPING = ("ke_over_ie_max", "energy_error_max", "damping_over_work_max", "contact_damping_over_work_max")
OF_THE_WORK = ("damping_over_work_max", "contact_damping_over_work_max")
RULES: dict[str, Callable[[Run, float], str]] = {
    "ke_over_ie_max": _slower,
    "energy_error_max": _smaller_step,
    "damping_over_work_max": _less_damping,
    "contact_damping_over_work_max": _slower_contacts,
    "hourglass_over_internal_max": finer_shells,
    "penetration_over_radius_max": _stiffer_contacts,
}
