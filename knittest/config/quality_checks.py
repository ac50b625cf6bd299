"""Quality checks: their limits, limits that a user relaxed, and the fields that decide a test."""

from dataclasses import dataclass
from typing import Any, Literal

from knittest.base.history import Quality
from knittest.base.kinds import kinds
from knittest.config.base import field_meta
from knittest.config.fabric import CARD, Fabric
from knittest.config.presets import preset_settings
from knittest.config.run import Run, Solver
from knittest.config.yaml_loader import dotted_path

#: fields of the model on which quality checks depend, with the sign of the looser side: self-contact, yarn contact and
#: knitting yarn may be switched off
LIMIT_SIGNS: dict[tuple[str, ...], int] = {
    ("model", "macro", "self_contact"): -1,
    ("model", "meso", "contact"): -1,
    ("model", "meso", "knitting"): -1,
}
#: words of every message on a relaxed limit
LOOSER = "looser than the preset's"


@dataclass(frozen=True)
class RelaxedLimit:
    """Field ``name`` whose ``value`` is looser than ``preset``, the value of the run's preset; both in ``unit``."""

    name: str
    value: float
    preset: float
    unit: str

    @property
    def text(self) -> str:
        """``solver.max_kinetic_ratio = 50 %, looser than the preset's 5 %``."""
        unit = "" if self.unit in ("", "1") else f" {self.unit}"
        return f"{self.name} = {_value_text(self.value)}{unit}, {LOOSER} {_value_text(self.preset)}{unit}"


def relaxed_limits(run: Run) -> list[RelaxedLimit]:
    """Limits of ``run`` looser than those of presets and model defaults, which no config can change."""
    limits = {("solver", name): 1 for name in Solver.model_fields if name.startswith("max_")}
    rig = {("rig", name): sign for name, sign in kinds()[run.rig.kind].hinges.items()}
    settings = preset_settings(run.rig.kind, run.model.preset, run.model.scale)
    found = []
    for path, sign in (limits | rig | LIMIT_SIGNS).items():
        if path[1] in ("macro", "meso") and path[1] != run.model.scale:
            continue
        holder: Any = run
        preset: Any = settings
        for part in path[:-1]:
            holder, preset = getattr(holder, part), preset.get(part, {})
        name, fields = path[-1], type(holder).model_fields
        value = getattr(holder, name, None)
        if name not in fields or value is None:  # None: the test has a value of its own
            continue
        reference = preset.get(name, fields[name].default)
        reference = run.rig.usual[name] if reference is None else reference
        if sign * value > sign * reference:
            found.append(
                RelaxedLimit(dotted_path(path), value, reference, field_meta(type(holder), name).get("unit", ""))
            )
    return found


def _value_text(value: float) -> str:
    return str(value).lower() if isinstance(value, bool) else f"{value:g}"


#: rows of the energies that a quality check needs
LEAST_ROWS = 10
#: share of a limit above which a value gets a warning
NEAR = 0.5


@dataclass(frozen=True)
class SolverCheck:
    """Quality check of a number of :class:`Quality`, and of summary.json, by ``key``, times ``scale`` [%].

    ``limit`` is the solver field with its limit. ``only`` restricts it to a scale, or (``own``) to tests that name it.
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
        """Tell whether the check applies to ``run``."""
        if self.only == "own":
            return self.key in kinds()[run.rig.kind].checks
        return self.only in ("", run.model.scale)


#: also checked in static equilibrium
HOURGLASS = SolverCheck(
    "hourglass energy over internal energy", "hourglass_over_internal_max", "max_hourglass", only="macro"
)
SOLVER_CHECKS = (
    SolverCheck("kinetic energy over work", "ke_over_ie_max", "max_kinetic_ratio"),
    SolverCheck("energy error", "energy_error_max", "max_energy_error"),
    SolverCheck("damping energy over work", "damping_over_work_max", "max_damping"),
    SolverCheck("contact damping over work", "contact_damping_over_work_max", "max_contact_damping"),
    HOURGLASS,
    SolverCheck("penetration over radius", "penetration_over_radius_max", "max_penetration"),
    SolverCheck("initial yarn overlap over radius", "overlap_at_start", "max_overlap"),
    SolverCheck("force-free yarn overlap over radius", "force_free_overlap_max", "max_force_free_overlap", only="meso"),
    SolverCheck("added mass", "added_mass_pct", "max_added_mass", scale=1.0),
    SolverCheck("share of shell elements beyond the end of a law", "beyond_law", "max_law_extrapolation", only="macro"),
    SolverCheck(
        "damping force over weight and blank-holder force", "drag_over_weight", "max_damping_force", only="own"
    ),
)


def quality_checks_of(run: Run) -> list[SolverCheck]:
    """Quality checks of a run that is integrated in time."""
    return [check for check in SOLVER_CHECKS if check.applies(run)]


def check_relaxed_limits(run: Run, quality: Quality) -> Quality:
    """Fail ``quality`` for each limit that is looser than the preset's; only warn if the run accepts them."""
    found = [one.text for one in relaxed_limits(run)]
    if run.accept_limits:
        return quality.with_warnings(*(f"{text}: accepted by --accept-limits" for text in found))
    for text in found:
        quality = quality.with_failed_check(f"{text}: use the preset's value, or accept it with --accept-limits")
    return quality


#: beginning of the reference of a number that was derived from a cell of the yarns; their digest follows
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


def deciding_fields(run: Run) -> tuple[str, ...]:
    """Fields of the fabric or the rig that decide the compared results of ``run``, without those that are missing."""
    fields = kinds()[run.rig.kind].deciding.get(run.model.scale, ())
    named = [one for field in fields for one in _of_layers(run, field.format(d=run.direction))]
    return tuple(field for field in named if field.startswith("rig.") or field_value(run.fabric, field) is not None)


def _of_layers(run: Run, field: str) -> list[str]:
    """``field`` of the yarns of the layers along the test, or of all where none lies along it."""
    card, _, name = field.partition(".")
    if card != "reinforcing":
        return [field]
    inlays = run.fabric.inlays_along(run.direction or "") or run.fabric.inlays
    return list(dict.fromkeys(f"{one.field}.{name}" for one in inlays))


def field_value(holder: Fabric | Run, field: str) -> object:
    """Value of ``field`` of a fabric or a run; None if it is missing."""
    value: object = holder
    for part in field.split("."):
        if isinstance(value, list) and part.isdigit():
            value = value[int(part)] if int(part) < len(value) else None
        else:
            value = value.get(part) if isinstance(value, dict) else getattr(value, part, None)
    return value


def is_in_macro_card(field: str) -> bool:
    """Tell whether ``field`` is in a part of the macro material card that can be derived from yarns."""
    return any(field.startswith(f"macro.{part}") for part in CARD)


def meso_run_behind_card(run: Run) -> Run:
    """The run at the meso scale if its macro material card was derived from the yarns, else ``run``."""
    fields = [field for field in deciding_fields(run) if is_in_macro_card(field)]
    cards = [str(getattr(field_value(run.fabric, field), "ref", "")) for field in fields]
    if run.model.scale == "meso" or not cards or not all(ref.startswith(FROM_YARNS) for ref in cards):
        return run
    return run.model_copy(update={"model": run.model.model_copy(update={"scale": "meso"})})


def reproduces_input(run: Run) -> bool:
    """Tell whether the results of ``run`` only reproduce its input, as of a macro tensile test its curve."""
    return run.model.scale in kinds()[run.rig.kind].fed
