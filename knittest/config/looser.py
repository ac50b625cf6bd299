"""Limits of a run that are looser than its preset's: a gate that its own user widens says nothing by itself."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from knittest.base.kinds import kinds
from knittest.config.base import field_meta
from knittest.config.presets import preset_settings
from knittest.config.run import Run, Scale, Solver
from knittest.config.yaml_loader import dotted

#: fields of the model that a gate hangs on, beside the limits of the gates and what tests state of their rigs, and the
#: sign of the looser side: contact that lets yarns and folds pass through each other, loops that are not there
HINGES: dict[tuple[str, ...], int] = {
    ("model", "macro", "self_contact"): -1,
    ("model", "meso", "contact"): -1,
    ("model", "meso", "knitting"): -1,
}
#: words of every refusal for a limit
LOOSER = "looser than the preset's"
_SCALES: dict[str, Scale] = {"macro": "macro", "meso": "meso"}


@dataclass(frozen=True)
class Loosened:
    """Field ``name`` whose ``value`` in a run is looser than ``preset``, that of the run's preset; both in ``unit``."""

    name: str
    value: float
    preset: float
    unit: str

    @property
    def stated(self) -> str:
        """``solver.max_kinetic_ratio = 50 %, looser than the preset's 5 %``."""
        unit = "" if self.unit in ("", "1") else f" {self.unit}"
        return f"{self.name} = {_shown(self.value)}{unit}, {LOOSER} {_shown(self.preset)}{unit}"


def loosened(run: Run) -> list[Loosened]:
    """Limits of ``run`` that are looser than its preset's, whoever asked for them.

    The reference are the tables of the presets and the defaults of the models, which no config reaches.
    """
    limits = {("solver", name): 1 for name in Solver.model_fields if name.startswith("max_")}
    rig = {("rig", name): sign for name, sign in kinds()[run.rig.kind].hinges.items()}
    return list(_looser(run, limits | rig | HINGES))


def _looser(run: Run, fields: dict[tuple[str, ...], int]) -> Iterator[Loosened]:
    settings = preset_settings(run.rig.kind, run.model.preset, run.model.scale)
    for path, sign in fields.items():
        if run.model.scale != _SCALES.get(path[1], run.model.scale):
            continue
        holder: Any = run
        preset: Any = settings
        for part in path[:-1]:
            holder, preset = getattr(holder, part), preset.get(part, {})
        name = path[-1]
        if name not in type(holder).model_fields:
            continue
        reference = preset.get(name, type(holder).model_fields[name].default)
        value = getattr(holder, name)
        if value is None:  # what the test takes by itself
            continue
        if reference is None:
            reference = run.rig.usual[name]
        if sign * value > sign * reference:
            yield Loosened(dotted(path), value, reference, field_meta(type(holder), name).get("unit", ""))


def _shown(value: float) -> str:
    return str(value).lower() if isinstance(value, bool) else f"{value:g}"
