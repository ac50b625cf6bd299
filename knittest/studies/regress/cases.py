"""Runs of a regression, by level."""

import json
from dataclasses import dataclass, replace
from functools import cache
from math import nan
from typing import Literal, cast

from knittest.base.errors import InputError
from knittest.base.files import data_dir
from knittest.base.kinds import kinds
from knittest.config.loading import resolve
from knittest.config.run import Preset, Run, Scale
from knittest.experiment.tables import published_rows
from knittest.export.identity import ARITHMETIC, cpu_model, library_versions, sha256_text
from knittest.studies.trials.trial import KEY_DIGITS, Trial, trial_of

Level = Literal["quick", "full"]
Table = Literal[3, 4]
#: data set of Table 4, and its variant
SOURCE, VARIANT = "pham2019", "1"


@cache
def paper_cost(test: str, scale: str) -> tuple[float, float] | None:
    """Elements and CPU hours of ``test`` at ``scale`` in Table 4; None for a test that the paper does not have."""
    rows = tuple(f"{test.replace('-', '_')}_{scale}_{what}" for what in ("elements", "cost"))
    found = {row.quantity: row.mean for row in published_rows(data_dir() / SOURCE, VARIANT, "", rows)}
    return (found.get(rows[0], nan), found.get(rows[1], nan)) if found else None


@dataclass(frozen=True)
class Case:
    """One run of a shipped variant: ``sets`` change its preset, which ``label`` names; ``parameters`` None is the
    default set; ``enlarges`` says that the run amplifies rounding.
    """

    test: str
    scale: Scale
    variant: str
    direction: str | None
    preset: Preset
    sets: tuple[str, ...] = ()
    label: str | None = None
    parameters: str | None = None
    enlarges: bool = False

    @property
    def name(self) -> str:
        """Name in the baseline: ``tensile-macro-v1-warp-quick``."""
        parts = (self.test, self.scale, f"v{self.variant}", self.direction, self.preset, self.label, self.parameters)
        return "-".join(part for part in parts if part)

    @property
    def specimen(self) -> str:
        """Specimen as in Table 3: ``V1 warp``."""
        return " ".join(part for part in (f"V{self.variant}", self.direction) if part)

    @property
    def rows(self) -> tuple[str, ...]:
        """Quantities of Table 3 that it has; none if ``sets`` change the specimen or the loads of its preset."""
        return () if self.sets else kinds()[self.test].regression.rows

    @property
    def tables(self) -> tuple[Table, ...]:
        """Tables of the paper with a row of this run."""
        published: list[Table] = [3] if self.rows else []
        cost = self.variant == VARIANT and paper_cost(self.test, self.scale) is not None
        return (*published, 4) if cost else tuple(published)

    def trial(self) -> Trial:
        """Trial of this case with the present code, data, libraries and processor."""
        run = resolve(
            test=self.test, variant=self.variant, scale=self.scale, direction=self.direction, preset=self.preset,
            parameters=self.parameters, sets=(*kinds()[self.test].regression.sets, *self.sets),
        )  # fmt: skip
        return local_trial(run, self.name)


def local_trial(run: Run, label: str) -> Trial:
    """Trial of ``run`` whose key depends on libraries and processor too, because these also cause drift."""
    trial, versions = trial_of(run, label), library_versions()
    content = [trial.key, cpu_model(), *(versions.get(name, "") for name in ARITHMETIC)]
    return replace(trial, key=sha256_text(json.dumps(content))[:KEY_DIGITS])


def cases_of(level: Level) -> list[Case]:
    """All runs of ``level``, long ones first."""
    runs = [(kind.name, runs) for kind in kinds().values() for runs in kind.regression.runs if runs.level == level]
    cases = []
    for test, one in sorted(runs, key=lambda item: item[1].rank):
        scale, preset, more = (
            cast("Scale", one.scale),
            cast("Preset", one.preset),
            (one.sets, one.label, one.parameters),
        )
        cases += [Case(test, scale, variant, along, preset, *more, one.enlarges) for variant, along in one.specimens]
    return cases


def all_names() -> set[str]:
    """Names of the runs of all levels."""
    return {case.name for level in LIMITS for case in cases_of(level)}


#: time limit of a run [s]
LIMITS: dict[Level, float] = {"quick": 1800.0, "full": 43200.0}


def select_cases(level: Level, scale: Literal["macro", "meso", "both"], table: Table | None) -> list[Case]:
    """Cases with rows in ``table`` (None: any), of Table 4 one a test; raises :class:`InputError` if there are none."""
    found = [case for case in cases_of(level) if scale in (case.scale, "both") and table in (None, *case.tables)]
    if table == 4:
        found = list({(case.test, case.scale): case for case in reversed(found)}.values())[::-1]
    if not found:
        asked = f"--level {level} --scale {scale}" + (f" --table {table}" if table else "")
        raise InputError(f"{asked}: no run has these rows; use --level full")
    return found
