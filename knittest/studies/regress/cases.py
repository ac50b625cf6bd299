"""The runs of a regression, by level."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

from knittest.base.errors import InputError
from knittest.config.loading import resolve
from knittest.config.run import Preset, Scale
from knittest.studies.trials.trial import Trial, trial_of

Level = Literal["quick", "full"]
Table = Literal[3, 4]

STRIPS = (("1", "warp"), ("1", "weft"), ("2", "warp"), ("2", "weft"))
#: rows of Table 3 (and of Eq. 3) that a test gives
QUANTITIES: dict[str, tuple[str, ...]] = {
    "tensile": ("peak_force_n", "fracture_strain_pct"),
    "cantilever": ("overhang_mm", "bending_stiffness_mncm2"),
    "friction": ("mu_paper",),
    "picture-frame": (),
    "forming": (),
}
#: the laboratory's cantilever finds the overhang; the paper's simulation is given it
SETS: dict[str, tuple[str, ...]] = {"cantilever": ("rig.mode=overhang",)}


@dataclass(frozen=True)
class Case:
    """One run: a test of a shipped variant; ``direction`` None where the test has none, ``sets`` what it does not take
    from its preset and ``label`` says so in its name.
    """

    test: str
    scale: Scale
    variant: str
    direction: str | None
    preset: Preset
    sets: tuple[str, ...] = ()
    label: str | None = None

    @property
    def name(self) -> str:
        """Name in the baseline: ``tensile-macro-v1-warp-quick``."""
        parts = (self.test, self.scale, f"v{self.variant}", self.direction, self.preset, self.label)
        return "-".join(part for part in parts if part)

    @property
    def specimen(self) -> str:
        """``V1 warp``, as Table 3 has it."""
        return " ".join(part for part in (f"V{self.variant}", self.direction) if part)

    @property
    def tables(self) -> tuple[Table, ...]:
        """Tables of the paper that it has a row in; Table 4 is on variant 1."""
        published: list[Table] = [3] if QUANTITIES[self.test] else []
        return (*published, 4) if self.variant == "1" else tuple(published)

    def trial(self) -> Trial:
        """Trial of this case, with the code and data that are here now."""
        run = resolve(
            test=self.test, variant=self.variant, scale=self.scale, direction=self.direction, preset=self.preset,
            sets=(*SETS.get(self.test, ()), *self.sets),
        )  # fmt: skip
        return trial_of(run, self.name)


def _strips(test: str, scale: Scale, preset: Preset) -> Iterator[Case]:
    for variant, direction in STRIPS:
        yield Case(test, scale, variant, direction, preset)


#: expensive ones first, so that no worker is left alone with one at the end
LEVELS: dict[Level, tuple[Case, ...]] = {
    "quick": (
        Case("forming", "macro", "1", None, "quick", ("rig.blank_holder_force=100",), "100n"),
        Case("tensile", "meso", "1", "weft", "quick"),  # nothing was tuned on its strain
        Case("picture-frame", "meso", "1", None, "quick", ("rig.side=20",), "20mm"),
        Case("picture-frame", "macro", "1", None, "quick"),
        *_strips("cantilever", "macro", "quick"),
        Case("friction", "macro", "1", "warp", "quick"),
        *_strips("tensile", "macro", "quick"),
    ),
    "full": (
        Case("picture-frame", "meso", "1", None, "standard"),
        *_strips("cantilever", "meso", "paper"),
        Case("friction", "meso", "1", "warp", "standard"),
        *_strips("tensile", "meso", "paper"),
        Case("picture-frame", "macro", "1", None, "standard"),
        *_strips("cantilever", "macro", "paper"),
        Case("friction", "macro", "1", "warp", "paper"),
        Case("friction", "macro", "2", "warp", "paper"),
        *_strips("tensile", "macro", "paper"),
    ),
}
#: seconds that one run may take
LIMITS: dict[Level, float] = {"quick": 1800.0, "full": 43200.0}


def chosen_cases(level: Level, scale: Literal["macro", "meso", "both"], table: Table | None) -> list[Case]:
    """Cases of ``level`` at ``scale`` with rows in ``table`` (None: any), for Table 4 one a test and scale; raises
    :class:`InputError` for none.
    """
    found = [case for case in LEVELS[level] if scale in (case.scale, "both") and table in (None, *case.tables)]
    if table == 4:
        found = list({(case.test, case.scale): case for case in reversed(found)}.values())[::-1]
    if not found:
        asked = f"--level {level} --scale {scale}" + (f" --table {table}" if table else "")
        raise InputError(f"{asked}: no run has such rows; use --level full")
    return found
