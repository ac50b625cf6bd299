"""Advice on what a refused forming test should change."""

from collections.abc import Callable

from knittest.base.rounding import rounded_down
from knittest.laboratory.advice import Setting, finer_shells
from knittest.laboratory.forming.config import FormingRun
from knittest.laboratory.forming.free_yarns import in_plane_bending
from knittest.laboratory.forming.presets import FREE_BLANK


def less_damping(run: FormingRun, share: float) -> Setting | str:
    """Damping, with the speed of a free blank, at which its loss comes down to ``share`` of itself."""
    damping, speed = run.solver.damping, run.solver.speed
    free_damping, free_speed = FREE_BLANK["damping"], FREE_BLANK["speed"]
    if run.rig.blank_holder_force == 0.0 and (damping > free_damping or speed > free_speed):
        if run.model.scale == "meso":
            return f"lower solver.damping, which is {damping:g}, and solver.speed, which is {speed:g}"
        return f"solver.damping={free_damping:g} with solver.speed={free_speed:g} passes on shells of quick"
    # a flange that is damped less swings more, so its loss falls about with the root of the damping
    why = "it goes with the root of the damping"
    return Setting(why, "solver.damping", damping, rounded_down(damping * share**2), "try {}")


def held_in_the_plane(run: FormingRun, share: float) -> Setting | str:
    """Inlays that bend in the plane: without, finer shells only fold into finer bands, at more hourglass energy."""
    if run.fabric.macro.in_plane_bending is not None:
        return finer_shells(run, share)
    return f"shells whose inlays do not bend in the plane fold into bands, the finer the more: {in_plane_bending(run)}"


ADVICE: dict[str, Callable[[FormingRun, float], Setting | str]] = {
    "damping_over_work_max": less_damping,
    "drag_over_weight": less_damping,
    "hourglass_over_internal_max": held_in_the_plane,
}
