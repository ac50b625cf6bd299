"""Warnings on numbers of a run: suspicious values, unused fields, in-plane bending stiffness derived from yarns."""

from collections.abc import Iterator
from contextlib import suppress
from typing import get_args

from knittest.base.errors import InputError
from knittest.base.files import configs_dir
from knittest.config.base import PerDirection, Quantity
from knittest.config.fabric import YARN_LEVEL, Direction, Fabric
from knittest.config.gates import deciding, entry
from knittest.config.loading import resolve
from knittest.config.run import Run
from knittest.config.settings import leaves

#: the reference of a derived number begins with its formula and ends with the number
FORMULA = "EI of an inlay x inlays per width"


def derived_in_plane_bending(fabric: Fabric) -> PerDirection | None:
    """EI of an inlay times the inlays per width [N mm]; none where the fabric does not describe its inlays."""
    if fabric.reinforcing is None:
        return None
    found = {d: _derived(fabric, d) for d in get_args(Direction)}
    return PerDirection(warp=found["warp"], weft=found["weft"])


def is_derived(quantity: Quantity) -> bool:
    """Tell whether ``quantity`` was derived by this formula and not edited since."""
    told = quantity.ref.startswith(FORMULA) and quantity.ref.endswith(_shown(quantity.value))
    return quantity.source == "derived" and told


def follows_yarns(fabric: Fabric) -> bool:
    """Tell whether the bending in the plane of ``fabric`` is derived in any direction."""
    found = fabric.macro.in_plane_bending
    return found is not None and (is_derived(found.warp) or is_derived(found.weft))


def with_in_plane_bending(fabric: Fabric) -> Fabric:
    """``fabric`` with its stated bending in the plane, and a derived one where it states none.

    A number that was derived before is derived again: it follows a yarn or a density that has changed since.
    """
    stated, derived = fabric.macro.in_plane_bending, derived_in_plane_bending(fabric)
    if derived is None:
        return fabric
    kept = {} if stated is None else {d: stated.of(d) for d in get_args(Direction) if not is_derived(stated.of(d))}
    return _with(fabric, derived.model_copy(update=kept))


def without_in_plane_bending(fabric: Fabric) -> Fabric:
    """``fabric`` whose inlays do not bend in the plane of the shells."""
    return _with(fabric, None)


def _with(fabric: Fabric, bending: PerDirection | None) -> Fabric:
    macro = fabric.macro.model_copy(update={"in_plane_bending": bending})
    return fabric.model_copy(update={"macro": macro})


def _derived(fabric: Fabric, direction: Direction) -> Quantity:
    yarn = fabric.reinforcing.bending_stiffness.of(direction)
    density = fabric.warp_density if direction == "warp" else fabric.weft_density
    value = fabric.reinforcing.bending_stiffness_n_mm2.of(direction) * fabric.density_per_mm.of(direction)
    return Quantity(
        value=value,
        source="derived",
        ref=f"{FORMULA}: reinforcing.bending_stiffness.{direction} {yarn.value:g} N mm2 ({yarn.source}) x "
        f"{direction}_density {density.value:g} / 100 mm ({density.source}){_shown(value)}",
    )


def _shown(value: float) -> str:
    return f" = {value:.6g} N mm"


#: parts of a fabric that no shell is computed from, and none of the yarns, whose reference the tension curves are
OF_YARNS = (*YARN_LEVEL, "warp_density", "weft_density")
OF_SHELLS, REFERENCE = ("macro",), ("macro.tension",)
#: fields that a warning names
NAMED = 4


def unread_note(run: Run) -> str:
    """Warning of changed numbers that ``run`` does not read, with what to do; empty without any."""
    macro = run.model.scale == "macro"
    own = _leaves(run.fabric)
    unread = OF_YARNS if macro else OF_SHELLS
    found = [(f.name, [n for n in _changed(own, _leaves(f), unread) if not _below(n, REFERENCE)]) for f in _likes(run)]
    name, changed = min(found, key=lambda one: len(one[1]), default=("", []))
    if not changed:
        return ""
    listed = ", ".join(f"fabric.{field}" for field in changed[:NAMED])
    more = f" and {len(changed) - NAMED} more" if len(changed) > NAMED else ""
    if not macro:
        return f"yarns do not read {listed}{more}, changed from {name}: --scale macro does"
    but = "but for bending in the plane " if follows_yarns(run.fabric) else ""
    return (
        f"{but}shells do not read {listed}{more}, changed from {name}, whose card they have (fabric.macro): knittest "
        "homogenise makes a card of these yarns, --scale meso models them"
    )


def unused_notes(run: Run) -> Iterator[str]:
    """Warnings of numbers that a choice beside them switches off, and of a mass and thickness given for yarns."""
    fabric = run.fabric
    if run.model.scale == "macro":
        if (law := fabric.macro.shear) is None:
            return
        off = {
            "stiffness": law.kind == "table" and law.stiffness, "curve": law.kind == "linear" and law.curve,
            "points": law.kind == "linear" and law.points,
        }  # fmt: skip
        yield from (_unused(f"macro.shear.{name}", f"kind is {law.kind}") for name, stated in off.items() if stated)
        if law.unloading_stiffness is not None and law.friction_share.value == 0.0:
            yield _unused("macro.shear.unloading_stiffness", "friction_share is 0")
        return
    for system in ("reinforcing", "knitting"):
        axial = getattr(fabric, system).law
        if axial.toe_strain and axial.kind != "toe":
            yield _unused(f"{system}.law.toe_strain", f"kind is {axial.kind}")
        if axial.points and axial.kind != "table":
            yield _unused(f"{system}.law.points", f"kind is {axial.kind}")
    for name, instead in (("thickness", "diameters"), ("area_mass", "linear densities")):
        if getattr(fabric, name).source == "user" and name not in deciding(run):
            yield _unused(name, f"at the meso scale the {instead} of the yarns count")


def _unused(field: str, reason: str) -> str:
    return f"fabric.{field} is not used: {reason}"


def _likes(run: Run) -> Iterator[Fabric]:
    """The shipped fabric of ``run``, or any for other shells, whose card decides the test as that of the run does."""
    names = sorted(path.stem for path in (configs_dir() / "fabrics").glob("*.yaml"))
    fields = [field for field in deciding(run) if field.startswith("macro.")]
    if run.fabric.name in names:
        names = [run.fabric.name]
    elif not fields:
        return
    own = _leaves(run.fabric)
    for fabric in (fabric for name in names for fabric in _shipped(name, run.parameters)):
        stated = tuple(field for field in fields if entry(fabric, field) is not None)
        if not _changed(own, _leaves(fabric), stated):
            yield fabric


def _shipped(name: str, chosen: str) -> Iterator[Fabric]:
    """The shipped fabric ``name`` by those of its sets of numbers that a fabric may have been started from."""
    for one in (chosen, None, "as-measured"):
        with suppress(InputError):  # it has no such set
            yield resolve(variant=name, parameters=one, scale="macro").fabric


def _leaves(fabric: Fabric) -> dict[str, object]:
    found = leaves(fabric.model_dump(mode="json"))
    return {name: value for name, value in found if not name.endswith(".description")}


def _changed(own: dict[str, object], other: dict[str, object], parts: tuple[str, ...]) -> list[str]:
    """Fields below ``parts`` in which both differ."""
    names = [name for name in dict.fromkeys([*own, *other]) if _below(name, parts)]
    return [name for name in names if own.get(name) != other.get(name)]


def _below(name: str, parts: tuple[str, ...]) -> bool:
    return any(name == part or name.startswith(f"{part}.") for part in parts)


#: scale of the slack [%] below which it moves no result: a yarn of 200 mm is 0.04 mm longer
LEAST_SLACK = 0.02
#: what is said of a derived number whose simulation did not pass its quality checks
REJECTED = " is derived from a simulation that failed its quality checks: "
#: draw-in [%] below which it is lost in the scatter of any loop length
LEAST_DRAW_IN = 0.1
#: thickness of a fabric over that of two inlays and two loop yarns, beyond which one of them is another fabric's
THICKNESS = (0.7, 1.4)


def doubts(run: Run) -> list[str]:
    """Warnings of numbers that ``run`` does not read, that do not fit its yarns, or that look like fractions."""
    return [
        *filter(None, [unread_note(run)]), *unused_notes(run), *_unlike_the_yarns(run.fabric), *_as_fractions(run),
        *_rejected_card(run),
    ]  # fmt: skip


def _unlike_the_yarns(fabric: Fabric) -> Iterator[str]:
    """Thickness that the yarns hardly make; far beyond, it is an error."""
    if fabric.reinforcing is None or fabric.knitting is None:
        return
    inlays = sum(fabric.reinforcing.section_mm(direction)[1] for direction in ("warp", "weft"))
    made, stated = inlays + 2.0 * fabric.knitting.beam_diameter_mm, fabric.thickness
    low, high = (share * made for share in THICKNESS)
    if not low <= stated.value <= high:
        yield (
            f"fabric.thickness = {stated.value:g} mm ({stated.source}), but two inlays and two loop yarns make "
            f"{made:.3g} mm, expected {low:.3g} to {high:.3g} mm: correct it or beam_diameter of the yarns"
        )


def _rejected_card(run: Run) -> Iterator[str]:
    """Shear laws and bending stiffnesses of the shells that were derived from a simulation that was rejected."""
    macro = run.fabric.macro
    if run.model.scale == "meso" or macro.shear is None or macro.bending_stiffness is None:
        return
    bending = {f"bending_stiffness.{d}": macro.bending_stiffness.of(d).ref for d in ("warp", "weft")}
    for name, ref in {"shear": macro.shear.ref, **bending}.items():
        if REJECTED in ref:
            yield f"fabric.macro.{name}{REJECTED}{ref.partition(REJECTED)[2]}; give your own"


def _as_fractions(run: Run) -> Iterator[str]:
    """Slack and draw-in next to none, which are no error, as studies draw them from 0 on."""
    if run.model.scale == "macro":
        return
    slack, draw_in = run.fabric.reinforcing.slack, run.fabric.knitting.draw_in
    given = [(f"reinforcing.slack.{d}", slack.of(d).value, LEAST_SLACK) for d in ("warp", "weft")]
    given += [("knitting.draw_in", draw_in.value, LEAST_DRAW_IN)] if draw_in else []
    for name, value, least in given:
        if 0.0 < value < least:
            yield (
                f"fabric.{name} = {value:g} % is next to none, expected 0, or at least {least:g} %: if it is a "
                f"fraction, write {100.0 * value:g}"
            )
