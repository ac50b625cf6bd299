"""Quality checks that all tests share: their limits, limits that a user relaxed, and the fields that decide a test."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Literal

from knittest.base.history import Quality
from knittest.base.kinds import kinds
from knittest.config.base import field_meta
from knittest.config.fabric import CARD, Fabric
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


#: rows of the energies that a judgement needs
LEAST_ROWS = 10
#: share of a limit from which on a value is worth a warning
NEAR = 0.5


@dataclass(frozen=True)
class SolverGate:
    """Gate on a number of :class:`Quality`, and of summary.json, by ``key``, times ``scale`` [%].

    ``limit`` is the solver's field that bounds it; ``only``, where it is not for all, a scale, or ``own`` for tests
    whose record names it.
    """

    label: str
    key: str
    limit: str
    scale: float = 100.0
    only: Literal["", "macro", "meso", "own"] = ""

    def value(self, quality: Quality) -> float:
        """Value in a run [%]."""
        return self.scale * float(getattr(quality, self.key))

    def applies(self, run: Run) -> bool:
        """Tell whether it means something in ``run``."""
        if self.only == "own":
            return self.key in kinds()[run.rig.kind].gates
        return self.only in ("", run.model.scale)


#: judged of shells at rest too
HOURGLASS = SolverGate("hourglass over internal energy", "hourglass_over_internal_max", "max_hourglass", only="macro")
GATES = (
    SolverGate("kinetic energy over work", "ke_over_ie_max", "max_kinetic_ratio"),
    SolverGate("energy error", "energy_error_max", "max_energy_error"),
    SolverGate("damping over work", "damping_over_work_max", "max_damping"),
    SolverGate("damping of contacts over work", "contact_damping_over_work_max", "max_contact_damping"),
    HOURGLASS,
    SolverGate("penetration over radius", "penetration_over_radius_max", "max_penetration"),
    SolverGate("overlap of yarns at the start", "overlap_at_start", "max_overlap"),
    SolverGate("overlap of yarns that carries no force", "force_free_overlap_max", "max_force_free", only="meso"),
    SolverGate("added mass", "added_mass_pct", "max_added_mass", scale=1.0),
    SolverGate("sheared beyond the end of the law", "beyond_law", "max_beyond_law", only="macro"),
    SolverGate("drag of damping over weight and holder's force", "drag_over_weight", "max_drag", only="own"),
)


def gates_of(run: Run) -> list[SolverGate]:
    """The gates of a test that is integrated in time."""
    return [gate for gate in GATES if gate.applies(run)]


def limits_judged(run: Run, quality: Quality) -> Quality:
    """``quality``, refused where a limit is looser than the preset's and nobody accepted that; else with a warning."""
    found = [one.stated for one in loosened(run)]
    if run.accept_limits:
        return quality.warning(*(f"{text}: accepted by --accept-limits" for text in found))
    for text in found:
        quality = quality.refusing(f"{text}: leave it, or accept it with --accept-limits")
    return quality


#: beginning of the reference of what was derived from a cell of the fabric's yarns; their digest follows
FROM_YARNS = "derived from one cell of the yarns "
#: fields that decide a row of the relaxed cell
CELL: dict[str, tuple[str, ...]] = {
    "thickness_mm": (
        "warp_density", "weft_density", "loop_length", "reinforcing.beam_diameter", "knitting.beam_diameter",
        "reinforcing.crimp.warp", "reinforcing.crimp.weft",
    ),
    "area_mass_g_m2": (
        "warp_density", "weft_density", "loop_length", "reinforcing.linear_density", "knitting.linear_density",
    ),
}  # fmt: skip


def deciding(run: Run) -> tuple[str, ...]:
    """Fields of the fabric, or of the rig, that decide what is compared of ``run``; none that the fabric leaves out."""
    fields = kinds()[run.rig.kind].deciding.get(run.model.scale, ())
    named = (field.format(d=run.direction) for field in fields)
    return tuple(field for field in named if field.startswith("rig.") or entry(run.fabric, field) is not None)


def entry(fabric: Fabric, field: str) -> object:
    """Entry of ``field`` of ``fabric``, none where it is left out; a path of a curve has no source."""
    value: object = fabric
    for part in field.split("."):
        value = value.get(part) if isinstance(value, dict) else getattr(value, part, None)
    return value


def in_card(field: str) -> bool:
    """Tell whether ``field`` is of a part of the card that is derived from yarns."""
    return any(field.startswith(f"macro.{part}") for part in CARD)


def by_its_yarns(run: Run) -> Run:
    """``run``, or where the card that decides it was derived from the fabric's yarns the same run of those."""
    fields = [field for field in deciding(run) if in_card(field)]
    cards = [str(getattr(entry(run.fabric, field), "ref", "")) for field in fields]
    if run.model.scale == "meso" or not cards or not all(ref.startswith(FROM_YARNS) for ref in cards):
        return run
    return run.model_copy(update={"model": run.model.model_copy(update={"scale": "meso"})})


def is_fed(run: Run) -> bool:
    """Tell whether the test returns its input: shells their curves, faces their friction, a strip its bending."""
    return run.model.scale in kinds()[run.rig.kind].fed
