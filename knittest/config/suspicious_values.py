"""Warnings about a run: suspicious values, unused fields, in-plane bending stiffness derived from yarns."""

from collections.abc import Iterator
from contextlib import suppress
from typing import get_args

from knittest.base.errors import InputError
from knittest.base.files import configs_dir
from knittest.config.base import PerDirection, Quantity
from knittest.config.fabric import CARD, YARN_LEVEL, Direction, Fabric
from knittest.config.loading import resolve
from knittest.config.quality_checks import deciding_fields, field_value
from knittest.config.run import Run
from knittest.config.settings import leaf_values

#: beginning of the reference of a derived number, which ends with the number
FORMULA = "EI of an inlay x inlays per width"


def is_derived(quantity: Quantity) -> bool:
    """Tell whether ``quantity`` was derived by this formula and not edited since."""
    return (
        quantity.source == "derived"
        and quantity.ref.startswith(FORMULA)
        and quantity.ref.endswith(_stiffness_text(quantity.value))
    )


def follows_yarns(fabric: Fabric) -> bool:
    """Tell whether the in-plane bending stiffness of ``fabric`` is derived in any direction."""
    found = fabric.macro.in_plane_bending
    return found is not None and (is_derived(found.warp) or is_derived(found.weft))


def with_in_plane_bending(fabric: Fabric) -> Fabric:
    """Fabric with its in-plane bending stiffness, derived [N mm] where ``fabric`` gives none and describes its inlays.

    A direction without inlays has the bending stiffness of its loops. A number that was derived before is derived
    again, so that it follows changed yarns and densities.
    """
    stated = fabric.macro.in_plane_bending
    if not can_derive_bending(fabric):
        return fabric
    kept = {} if stated is None else {d: stated.of(d) for d in get_args(Direction) if not is_derived(stated.of(d))}
    return _replace_bending(fabric, PerDirection(**{d: _derive(fabric, d) for d in get_args(Direction)} | kept))


def can_derive_bending(fabric: Fabric) -> bool:
    """Tell whether ``fabric`` describes inlays, and loops where a direction has no inlays."""
    return bool(fabric.inlays) and all(fabric.yarn_bending_n_mm(d) > 0.0 for d in get_args(Direction))


def without_in_plane_bending(fabric: Fabric) -> Fabric:
    """Fabric whose inlays have no in-plane bending stiffness in the macro model."""
    return _replace_bending(fabric, None)


def _replace_bending(fabric: Fabric, bending: PerDirection | None) -> Fabric:
    macro = fabric.macro.model_copy(update={"in_plane_bending": bending})
    return fabric.model_copy(update={"macro": macro})


def _derive(fabric: Fabric, direction: Direction) -> Quantity:
    density = fabric.warp_density if direction == "warp" else fabric.weft_density
    value, yarns = fabric.yarn_bending_n_mm(direction), []
    for one in fabric.inlays_along(direction):
        bending = one.yarn.bending_stiffness.of(direction)
        every = "" if one.share == 1.0 else f" x {one.share:.3g}"
        yarns.append(f"{one.field}.bending_stiffness.{direction} {bending.value:g} N mm2 ({bending.source}){every}")
    if not yarns and fabric.knitting is not None:
        bending, of = fabric.knitting.bending_stiffness, fabric.yarn_bending_n_mm(direction) / (0.01 * density.value)
        yarns = [f"loops {of:.4g} N mm2, by knitting.bending_stiffness {bending.value:g} N mm2 ({bending.source})"]
    return Quantity(
        value=value,
        source="derived",
        ref=f"{FORMULA}: {' + '.join(yarns)} x "
        f"{direction}_density {density.value:g} / 100 mm ({density.source}){_stiffness_text(value)}",
    )


def _stiffness_text(value: float) -> str:
    return f" = {value:.6g} N mm"


#: parts of a fabric that the macro model and that the meso model do not read; the latter compares with tension curves
YARN_FIELDS = (*YARN_LEVEL, "stitches", "warp_density", "weft_density")
OF_SHELLS, REFERENCE = ("macro",), ("macro.tension",)
#: largest number of fields in a warning
MOST_NAMED = 4


def unused_change_warning(run: Run) -> str:
    """Warning about changed numbers that ``run`` does not read, with the remedy; empty without any."""
    macro = run.model.scale == "macro"
    own = _fabric_leaves(run.fabric)
    unread = YARN_FIELDS if macro else OF_SHELLS
    found = [
        (f.name, [n for n in _changed_fields(own, _fabric_leaves(f), unread) if not _is_below(n, REFERENCE)])
        for f in _similar_fabrics(run)
    ]
    name, changed = min(found, key=lambda one: len(one[1]), default=("", []))
    if not changed:
        return ""
    listed = ", ".join(f"fabric.{field}" for field in changed[:MOST_NAMED])
    more = f" and {len(changed) - MOST_NAMED} more" if len(changed) > MOST_NAMED else ""
    if not macro:
        return f"the meso model does not use {listed}{more}, changed from {name}: use --scale macro"
    but = "except for in-plane bending, " if follows_yarns(run.fabric) else ""
    return (
        f"{but}the macro model does not use {listed}{more}, changed from {name}, whose material card (fabric.macro) it "
        "has: derive a card from these yarns by knittest homogenise, or use --scale meso"
    )


def unused_field_warnings(run: Run) -> Iterator[str]:
    """Warnings about numbers that another field switches off, and about mass and thickness at the meso scale."""
    fabric = run.fabric
    if run.model.scale == "macro":
        if (law := fabric.macro.shear) is None:
            return
        off = {
            "stiffness": law.kind == "table" and law.stiffness, "curve": law.kind == "linear" and law.curve,
            "points": law.kind == "linear" and law.points,
        }  # fmt: skip
        yield from (
            _unused_text(f"macro.shear.{name}", f"kind is {law.kind}") for name, stated in off.items() if stated
        )
        if law.unloading_stiffness is not None and law.friction_share.value == 0.0:
            yield _unused_text("macro.shear.unloading_stiffness", "friction_share is 0")
        return
    for system, yarn in fabric.yarn_cards.items():
        axial = yarn.law
        if axial.toe_strain and axial.kind != "toe":
            yield _unused_text(f"{system}.law.toe_strain", f"kind is {axial.kind}")
        if axial.points and axial.kind != "table":
            yield _unused_text(f"{system}.law.points", f"kind is {axial.kind}")
    for name, instead in (("thickness", "diameters"), ("area_mass", "linear densities")):
        if getattr(fabric, name).source == "user" and name not in deciding_fields(run):
            yield _unused_text(name, f"the meso scale uses the {instead} of the yarns")


def _unused_text(field: str, reason: str) -> str:
    return f"fabric.{field} is not used: {reason}"


def _similar_fabrics(run: Run) -> Iterator[Fabric]:
    """Shipped fabrics with the name of that of ``run``, else those with the same numbers that decide the macro test."""
    names = sorted(path.stem for path in (configs_dir() / "fabrics").glob("*.yaml"))
    fields = [field for field in deciding_fields(run) if field.startswith("macro.")]
    if run.fabric.name in names:
        names = [run.fabric.name]
    elif not fields or run.fabric.macro.biaxial is not None:
        return
    own = _fabric_leaves(run.fabric)
    for fabric in (fabric for name in names for fabric in _shipped_versions(name, run.parameters)):
        stated = tuple(field for field in fields if field_value(fabric, field) is not None)
        if fabric.macro.missing_card_parts != CARD and not _changed_fields(own, _fabric_leaves(fabric), stated):
            yield fabric


def _shipped_versions(name: str, chosen: str) -> Iterator[Fabric]:
    """Shipped fabric ``name`` with each parameter set from which another fabric may have been started."""
    for one in (chosen, None, "as-measured"):
        with suppress(InputError):  # no such set
            yield resolve(variant=name, parameters=one, scale="macro").fabric


def _fabric_leaves(fabric: Fabric) -> dict[str, object]:
    found = leaf_values(fabric.model_dump(mode="json"))
    return {name: value for name, value in found if not name.endswith(".description")}


def _changed_fields(own: dict[str, object], other: dict[str, object], parts: tuple[str, ...]) -> list[str]:
    """Fields below ``parts`` in which both differ."""
    names = [name for name in dict.fromkeys([*own, *other]) if _is_below(name, parts)]
    return [name for name in names if own.get(name) != other.get(name)]


def _is_below(name: str, parts: tuple[str, ...]) -> bool:
    return any(name == part or name.startswith(f"{part}.") for part in parts)


#: smallest slack [%] that changes a result: a yarn of 200 mm is 0.04 mm longer
LEAST_SLACK = 0.02
#: words of the reference of a number that was derived from a simulation with failed quality checks
REJECTED = " is derived from a simulation that failed its quality checks: "
#: smallest loop shortening [%] that matters beside the scatter of loop lengths
LEAST_DRAW_IN = 0.1
#: thickness of a fabric over that of two inlays and two knitting yarns; outside, one of them is suspicious
THICKNESS = (0.7, 1.4)


def find_suspicious_values(run: Run) -> list[str]:
    """Warnings about unused and suspicious numbers of ``run``."""
    return [
        *filter(None, [unused_change_warning(run)]), *unused_field_warnings(run), *_thickness_notes(run.fabric),
        *_fraction_notes(run),
        *_rejected_card(run),
    ]  # fmt: skip


def _thickness_notes(fabric: Fabric) -> Iterator[str]:
    """Warning about a thickness that does not fit the yarns; far outside, it is an error."""
    if not fabric.has_yarns or fabric.knitting is None or not fabric.is_plain:
        return
    inlays = sum(one.section_mm[1] for one in fabric.inlays)
    made, stated = inlays + 2.0 * fabric.knitting.loose_diameter_mm, fabric.thickness
    low, high = (share * made for share in THICKNESS)
    if not low <= stated.value <= high:
        yield (
            f"fabric.thickness = {stated.value:g} mm ({stated.source}), expected {low:.3g} to {high:.3g} mm: "
            f"the inlays and two knitting yarns make {made:.3g} mm. Correct thickness or beam_diameter of the yarns"
        )


def _rejected_card(run: Run) -> Iterator[str]:
    """Warnings about parts of the macro material card that were derived from a rejected simulation."""
    macro = run.fabric.macro
    if run.model.scale == "meso" or macro.shear is None or macro.bending_stiffness is None:
        return
    bending = {f"bending_stiffness.{d}": macro.bending_stiffness.of(d).ref for d in ("warp", "weft")}
    tension = {"biaxial": macro.biaxial.ref} if macro.biaxial else {}
    for name, ref in {"shear": macro.shear.ref, **bending, **tension}.items():
        if REJECTED in ref:
            failure = first_failure(ref.partition(REJECTED)[2])
            decides = any(f"macro.{name}".startswith(field) for field in deciding_fields(run))
            yield (
                f"fabric.macro.{name} is not reliable: its cell simulation failed a quality check ({failure}). The "
                f"results of this test {'depend' if decides else 'do not depend'} on it. Add a measured value"
            )


def first_failure(failures: str) -> str:
    """First of the ``failures`` of quality checks, without its advice."""
    return failures.partition(";")[0]


def _fraction_notes(run: Run) -> Iterator[str]:
    """Warnings about a slack or loop shortening near 0; no error, because studies vary them from 0."""
    if run.model.scale == "macro":
        return
    draw_in, inlays = run.fabric.knitting.loop_shortening, run.fabric.inlays
    slacks = {f"{i.field}.slack.{i.direction}": i.yarn.slack.of(i.direction).value for i in inlays}
    given = [(field, value, LEAST_SLACK) for field, value in slacks.items()]
    given += [("knitting.loop_shortening", draw_in.value, LEAST_DRAW_IN)] if draw_in else []
    for name, value, least in given:
        if 0.0 < value < least:
            yield (
                f"fabric.{name} = {value:g} % has no effect, expected 0 or at least {least:g} %: if it is a fraction, "
                f"write {100.0 * value:g}"
            )
