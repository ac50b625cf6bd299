"""Config of the forming test: fields, presets, the size that is shown, and the origin of its results."""

from collections.abc import Sequence
from typing import ClassVar, Literal, Self, get_args

from pydantic import Field, model_validator

from knittest.base.kinds import Stated
from knittest.config.base import Kernel, number
from knittest.config.fabric import Direction
from knittest.config.rigs import Rig, check_friction_order
from knittest.config.run import Run
from knittest.config.suspicious_values import is_derived, with_in_plane_bending, without_in_plane_bending
from knittest.config.tools import Die, Holder, Stamp, check_blank, check_fit
from knittest.experiment.origin import Origin, assumed_fields, assumed_friction


class FormingRig(Rig):
    """Forming: a stamp draws a blank into a die, warp along y, with or without a blank holder."""

    spans = ("blank_length", "blank_width")

    kind: Literal["forming"] = "forming"
    blank_length: float = number(330.0, "mm", "blank along the warp, y", gt=0, band=(20, 2000))
    blank_length_mm: ClassVar[Kernel[float]] = Kernel("blank_length")
    blank_width: float = number(330.0, "mm", "blank along the weft, x", gt=0, band=(20, 2000))
    blank_width_mm: ClassVar[Kernel[float]] = Kernel("blank_width")
    depth: float = number(40.0, "mm", "travel of the stamp from the face of the blank", gt=0, band=(1, 500))
    depth_mm: ClassVar[Kernel[float]] = Kernel("depth")
    stamp: Stamp = Field(default_factory=Stamp, description="the stamp")
    die: Die = Field(default_factory=Die, description="the die")
    holder: Holder = Field(default_factory=Holder, description="the blank holder, if there is a force on it")
    blank_holder_force: float = number(0.0, "N", "force on the blank holder; 0: no holder", ge=0, le=1e5)
    blank_holder_force_n: ClassVar[Kernel[float]] = Kernel("blank_holder_force")
    static_coefficient: float = number(
        0.075, "1", "Coulomb coefficient between fabric and tools before it slips: one face of the friction test",
        ge=0, le=2,
    )  # fmt: skip
    kinetic_coefficient: float = number(0.075, "1", "Coulomb coefficient while it slips", ge=0, le=2)
    gravity: float = number(9.81, "m/s2", "gravity", ge=0, le=100)
    gravity_mm_per_ms2: ClassVar[Kernel[float]] = Kernel("gravity")
    imperfection: float = number(0.05, "mm", "amplitude of the seeded unevenness from which wrinkles start", ge=0, le=5)
    imperfection_mm: ClassVar[Kernel[float]] = Kernel("imperfection")
    membrane_share: float = number(
        0.05, "1", "share of the membrane or axial stiffness that is kept: yarns are far from their strength, and the "
        "step grows", gt=0, le=1,
    )  # fmt: skip
    stamp_speedup: float = number(
        1.0, "1", "largest speed of the stamp over solver.speed, which it reaches where the kinetic energy stays below "
        "0.4 of its limit; 1: constant speed", ge=1, le=10,
    )  # fmt: skip
    in_plane_bending: bool = Field(
        True, description="macro scale: inlays bend in the plane of the shells, as fabric.macro.in_plane_bending "
        "states, or else as EI of an inlay x inlays per width; false: they do not, and forces fall with the mesh",
    )  # fmt: skip
    risk_share: float = number(
        0.5, "1", "share of its strength at which a yarn counts as at risk of damage", gt=0, le=1
    )

    @model_validator(mode="after")
    def _tools_fit(self) -> Self:
        check_friction_order(self.static_coefficient, self.kinetic_coefficient)
        check_blank(self.stamp, self.blank_width, self.blank_length)
        check_fit(self.stamp, self.die, self.holder if self.blank_holder_force > 0.0 else None, self.depth_mm)
        return self


class FormingRun(Run):
    """A forming test."""

    rig: FormingRig = Field(default_factory=FormingRig)

    def structure_defaults(self) -> dict[tuple[str, str], float]:
        """Blanks whose loops carry a direction are formed slowly, at constant speed."""
        slowly = not self.fabric.has_inlays_both_ways
        if self.model.scale == "macro":
            slowly = self.fabric.has_biaxial_law and self.rig.blank_holder_force > 0.0
        return dict(LOOPS) if slowly else {}

    def with_derived_numbers(self) -> Self:
        """Return the run with in-plane bending of its inlays, or without if ``rig`` turns it off."""
        if self.model.scale != "macro":
            return self
        settle = with_in_plane_bending if self.rig.in_plane_bending else without_in_plane_bending
        return self.model_copy(update={"fabric": settle(self.fabric)})


#: speed [m/s] and damping [1/ms] of blanks without inlays in one direction: the stamp does little work on them;
#: of shells with a law of two strains under a holder
LOOPS = {("solver", "speed"): 0.1, ("solver", "damping"): 0.02, ("rig", "stamp_speedup"): 1.0}
#: side of a shell of the blank [mm], and speed of the stamp on yarns [m/s]
ELEMENT = {"quick": 6.0, "standard": 3.0, "paper": 2.0}
SPEED = {"quick": 0.2, "standard": 0.5, "paper": 0.5}
#: largest speed of the stamp on yarns over that
SPEEDUP = 3.0

#: lengths of the T-shaped stamp
T = (
    "bar_length", "bar_width", "stem_length", "stem_width", "edge_radius", "outer_corner_radius", "inner_corner_radius",
)  # fmt: skip


def _small_tools(blank: float, depth: float, t: Sequence[float], radius: float, **tools: object) -> dict[str, object]:
    """Sizes [mm] of a square ``blank``, its stroke, the stamps ``t`` and of ``radius``, and other ``tools``."""
    stamp = {"t": dict(zip(T, t, strict=True)), "hemisphere": {"radius": radius}}
    return {"blank_length": blank, "blank_width": blank, "depth": depth, "stamp": stamp, **tools}


#: smaller blank, stroke and stamp of a meso run: a tenth and a half of the beams. Gaps and floor remain: the fabric is
#: as thick
SMALL_TOOLS: dict[str, dict[str, object]] = {
    "quick": _small_tools(
        120.0, 15.0, (56.0, 20.0, 36.0, 20.0, 4.0, 5.0, 12.0), 20.0, die={"clearance": 6.0, "edge_radius": 4.0},
        holder={"clearance": 6.0},
    ),
    "standard": _small_tools(230.0, 28.0, (105.0, 35.0, 70.0, 35.0, 6.0, 9.0, 16.0), 35.0, die={"edge_radius": 6.0}),
    "paper": {},
}  # fmt: skip

#: macro forming without a holder: damping must not lift a flange that only its weight keeps down
FREE_BLANK: dict[str, float] = {"speed": 0.05, "damping": 0.006}


def settings(preset: str, scale: str, stated: Stated) -> dict[str, object]:
    """Settings of ``preset`` at ``scale``: folds of shells and yarns on tools need stiff penalties, so small steps."""
    model = {
        "meso": {"elements_per_loop": 20, "elements_per_wave": 4},
        "macro": {"element_size": ELEMENT[preset], "self_contact": True},  # its folds touch
    }
    if scale == "meso":  # less work is done on a small piece, so its inertia must be smaller
        solver = {"ramp": 10.0, "damping": 0.05, "safety": 0.7, "speed": SPEED[preset]}
        return {"model": model, "rig": SMALL_TOOLS[preset] | {"stamp_speedup": SPEEDUP}, "solver": solver}
    force = stated("blank_holder_force")
    free = {} if isinstance(force, int | float) and force > 0.0 else FREE_BLANK
    return {"model": model, "solver": {"speed": 0.19, "ramp": 20.0, "damping": 0.05, "safety": 0.9} | free}


def size_texts(run: FormingRun) -> tuple[str, ...]:
    """Size of the blank and what acts on it, in words."""
    rig = run.rig
    held = f"holder {rig.blank_holder_force:g} N" if rig.blank_holder_force > 0.0 else "no holder"
    return f"blank {rig.blank_width:g} x {rig.blank_length:g} mm", f"stamp {rig.stamp.kind}, {rig.depth:g} mm", held


DIRECTIONS: tuple[Direction, ...] = get_args(Direction)


class FormingOrigin(Origin[FormingRun]):
    """See :class:`knittest.experiment.origin.Origin`."""

    def assumed_inputs(self, run: FormingRun) -> tuple[str, ...]:
        """Assumed numbers of the fabric, also those behind derived in-plane bending, and assumed friction of tools."""
        bending, found = run.fabric.macro.in_plane_bending, []
        for direction in DIRECTIONS:
            inlays = run.fabric.inlays_along(direction)
            yarns = [f"{one.field}.bending_stiffness.{direction}" for one in inlays] or ["knitting.bending_stiffness"]
            fields = (*yarns, f"{direction}_density")
            if (
                bending is not None
                and is_derived(bending.of(direction))
                and (names := assumed_fields(run.fabric, fields))
            ):
                found.append(f"macro.in_plane_bending.{direction} (from {' and '.join(names)})")
        return (*super().assumed_inputs(run), *found, *assumed_friction(run))
