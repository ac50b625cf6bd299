"""Records that several tests share: deciding fields, the field that ends a run, a study that pages show."""

from collections.abc import Iterable
from dataclasses import dataclass

LOOPS = ("loop_length", "knitting.beam_diameter", "knitting.bending_stiffness", "knitting.degree_of_set")
TENSION_FIELDS = (
    "reinforcing.youngs_modulus", "reinforcing.load_area", "reinforcing.fracture_strain", "reinforcing.crimp.{d}",
    "reinforcing.slack.{d}",
)  # fmt: skip
#: patches count where a fabric states them
CROSSINGS = (
    "contact.friction_coefficient", "contact.patch.radius.inlay_inlay", "contact.patch.radius.inlay_loop",
    "contact.patch.radius.loop_loop", "contact.patch.compaction.reinforcing", "contact.patch.compaction.knitting",
)  # fmt: skip


def labels_at(name: str, words: str, form: str, places: Iterable[float]) -> dict[str, tuple[str, str]]:
    """Labels of the results ``name`` at ``places``, which ``words`` state, in the format ``form``."""
    return {f"{name}.{place}": (words.format(place), form) for place in places}


@dataclass(frozen=True)
class EndSetting:
    """``field`` that ends a run sooner, its present end ``now``, and how far beyond a place means reach (``near``)."""

    field: str
    now: float
    near: float


@dataclass(frozen=True)
class Study:
    """Table of a study: rows of a label and numbers (NaN: none) in the format ``form``; ``note`` states the source."""

    caption: str
    head: tuple[str, ...]
    rows: tuple[tuple[str, tuple[float, ...]], ...]
    note: str
    form: str = "{:.2f}"
