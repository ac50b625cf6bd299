"""Origin of the friction of plates and tools on a fabric: measured, of its other direction, or another fabric's."""

from knittest.config.own_rig import own_fields, own_value, taken_over
from knittest.config.run import Run

#: Coulomb coefficients of a rig
COEFFICIENTS = ("static_coefficient", "kinetic_coefficient")
#: experiment whose friction is the rigs' default
DEFAULT_FRICTION_OF = "pham2019"


def assumed_friction(run: Run) -> tuple[str, ...]:
    """Coefficients of the rig of ``run`` that were measured in the other direction alone, or are the defaults: those of
    the paper's fabrics, assumed for all others. Empty of a test without.
    """
    fabric, kind = run.fabric, run.rig.kind
    own = own_fields(fabric.rigs.get(kind, {}), kind, run.direction)
    other = taken_over(fabric, kind, run.direction)
    papers = (fabric.experiment or "").rpartition("/")[2] == DEFAULT_FRICTION_OF
    reasons: dict[str, list[str]] = {}
    for name in (name for name in COEFFICIENTS if name in type(run.rig).model_fields):
        value = getattr(run.rig, name)
        if name in other and value == own_value(fabric, kind, own[name]):
            reasons.setdefault(f"as {other[name]}, the only direction tested", []).append(f"rig.{name}")
        elif value == type(run.rig).model_fields[name].default and name not in own and not papers:
            reasons.setdefault(f"the default, that of {DEFAULT_FRICTION_OF}", []).append(f"rig.{name}")
    return tuple(f"{' and '.join(fields)} ({reason})" for reason, fields in reasons.items())
