"""Small records that several tests share: deciding fields, the field that ends a run, a study that pages show."""

from dataclasses import dataclass

LOOPS = ("loop_length", "knitting.beam_diameter", "knitting.bending_stiffness", "knitting.degree_of_set")
PULLED = (
    "reinforcing.youngs_modulus", "reinforcing.load_area", "reinforcing.fracture_strain", "reinforcing.crimp.{d}",
    "reinforcing.slack.{d}",
)  # fmt: skip
#: patches count where a fabric states them
CROSSINGS = (
    "contact.friction_coefficient", "contact.patch.radius.inlay_inlay", "contact.patch.radius.inlay_loop",
    "contact.patch.radius.loop_loop", "contact.patch.compaction.reinforcing", "contact.patch.compaction.knitting",
)  # fmt: skip


@dataclass(frozen=True)
class Ending:
    """``field`` of a run that ends it sooner, and where the run ends now; both in the unit of the field.

    Numbers at a place are means of the motion up to ``near`` beyond it.
    """

    field: str
    now: float
    near: float


@dataclass(frozen=True)
class Study:
    """Table of a study under its ``caption``: ``rows`` are a label and numbers, NaN where there is none, that ``form``
    shows; ``note`` says where they come from.
    """

    caption: str
    head: tuple[str, ...]
    rows: tuple[tuple[str, tuple[float, ...]], ...]
    note: str
    form: str = "{:.2f}"
