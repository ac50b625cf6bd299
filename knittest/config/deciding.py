"""Numbers that decide the results of a test; others are needed, but move them little."""

from knittest.base.kinds import kinds
from knittest.config.fabric import CARD, Fabric
from knittest.config.run import Run

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
