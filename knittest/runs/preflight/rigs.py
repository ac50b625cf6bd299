"""Rigs that runs of a fabric start from, as its file has them from its own tests."""

from typing import Any

from knittest.base.kinds import kinds
from knittest.config.fabric import Fabric
from knittest.config.fields import place
from knittest.config.own_rig import DIRECTIONS, own_fields, own_value, taken_over


def rigs_of(fabric: Fabric) -> list[dict[str, Any]]:
    """Fields that the runs of each test and direction start from; ``assumed`` are those of the other direction."""
    found = []
    for kind in fabric.rigs:
        for direction in DIRECTIONS if kinds()[kind].directional else ("",):
            fields = own_fields(fabric.rigs[kind], kind, direction)
            values = {name: own_value(fabric, kind, at) for name, at in fields.items()}
            assumed = taken_over(fabric, kind, direction)
            found.append({"test": kind, "direction": direction, "fields": values, "assumed": assumed})
    return found


def rig_lines(fabric: Fabric) -> list[str]:
    """:func:`rigs_of` as lines for a user; none of a fabric that says nothing of rigs."""
    lines = []
    for rig in rigs_of(fabric):
        fields, assumed = rig["fields"], rig["assumed"]
        told = ", ".join(f"{name} {value:g}{_unit(rig['test'], name)}" for name, value in fields.items())
        others = " and ".join(dict.fromkeys(assumed.values()))
        which = "" if len(assumed) == len(fields) else f" ({', '.join(assumed)})"
        why = f"; assumed{which}: as {others}, the only direction tested" if assumed else ""
        lines.append(f"  {' '.join(filter(None, (rig['test'], rig['direction'])))}: {told}{why}")
    return ["rigs that its runs start from, by its file; --set rig.NAME=... goes over them", *lines] if lines else []


def _unit(kind: str, name: str) -> str:
    field = place(("rig", name), kind)
    return f" {field.unit}" if field and field.unit not in ("", "1") else ""
