"""Numbers that decide the results of a test; others are needed, but move them little."""

from knittest.config.run import Run

_LOOPS = (
    "loop_length", "knitting.beam_diameter", "knitting.bending_stiffness", "knitting.degree_of_set",
)  # fmt: skip
_PULLED = (
    "reinforcing.youngs_modulus", "reinforcing.load_area", "reinforcing.fracture_strain", "reinforcing.crimp.{d}",
    "reinforcing.slack.{d}",
)  # fmt: skip
_CURVES = ("macro.tension.warp", "macro.tension.weft")
_MACRO: dict[str, tuple[str, ...]] = {
    "tensile": ("macro.tension.{d}", "macro.fracture_strain.{d}"),
    "picture-frame": ("macro.shear",),
    "cantilever": ("macro.bending_stiffness.{d}", "area_mass"),
    "friction": ("rig.kinetic_coefficient",),
    "forming": ("macro.shear", *_CURVES, "macro.bending_stiffness.warp", "macro.bending_stiffness.weft"),
}
_MESO: dict[str, tuple[str, ...]] = {
    "tensile": ("{d}_density", *_PULLED),
    "picture-frame": ("warp_density", "weft_density", *_LOOPS, "contact.friction_coefficient"),
    "cantilever": ("reinforcing.bending_stiffness.{d}", "area_mass"),
    "friction": ("rig.kinetic_coefficient",),
    "forming": (
        "warp_density", "weft_density", *_LOOPS, "contact.friction_coefficient", "reinforcing.bending_stiffness.warp",
        "reinforcing.bending_stiffness.weft",
    ),
}  # fmt: skip


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
    """Fields of the fabric, or of the rig, that decide what is compared of ``run``."""
    fields = (_MACRO if run.model.scale == "macro" else _MESO).get(run.rig.kind, ())
    return tuple(field.format(d=run.direction) for field in fields)


def is_fed(run: Run) -> bool:
    """Tell whether the test returns its input: shells their curves, faces their friction, a strip its bending."""
    kinds = ("tensile", "picture-frame", "cantilever", "friction")
    return run.rig.kind in kinds if run.model.scale == "macro" else run.rig.kind in ("cantilever", "friction")
