"""Numbers of a fabric that a run does not read: by its scale, or as another choice switches them off."""

from collections.abc import Iterator
from contextlib import suppress

from knittest.base.errors import InputError
from knittest.base.resources import configs_dir
from knittest.config.deciding import deciding, entry
from knittest.config.derived_bending import follows_yarns
from knittest.config.fabric import YARN_LEVEL, Fabric
from knittest.config.leaves import leaves
from knittest.config.loading import resolve
from knittest.config.run import Run

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
