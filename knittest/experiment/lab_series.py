"""Results of one import as its folder and table keep them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from knittest.base.atomic import write_atomic
from knittest.base.errors import InputError
from knittest.experiment.lab_checks import known_elsewhere
from knittest.experiment.lab_conditions import Condition
from knittest.experiment.lab_folder import (
    DIRECTIONS,
    STATISTICS,
    counted,
    folder_name,
    prepared,
    read_statistics,
    statistics_text,
    table_name,
    table_text,
)


@dataclass(frozen=True)
class Results:
    """Values (n,) of each quantity with its unit, the conditions that they hang on, and where they come from.

    ``direction`` is empty for a picture frame; ``what`` describes the specimens, such as ``strips of 50 mm``.
    ``digests`` tell their curves from those of other imports.
    """

    test: str
    direction: str
    found: Mapping[str, np.ndarray]
    units: Mapping[str, str]
    conditions: Sequence[tuple[Condition, float]]
    what: tuple[str, str]
    files: Sequence[str]
    digests: Sequence[str]

    def source(self, out: Path) -> str:
        """The citation that a reader is shown."""
        count = len(next(iter(self.found.values())))
        noun, more = self.what
        return ", ".join(filter(None, (out.resolve().name, f"{counted(count, noun)} {more}".strip(), self.direction)))

    def notes(self, out: Path) -> list[str]:
        """Lines for the head of a curve: source, test, direction and conditions."""
        lines = [f"# source: {self.source(out)}", f"# test: {self.test}"]
        lines += [f"# direction: {self.direction}"] if self.direction else []
        return lines + [f"# {what.key}: {value:g}" for what, value in self.conditions]


def write_results(out: Path, results: Results) -> Path:
    """Write statistics and table of ``results`` into the experiment ``out``; returns the folder for its curves.

    Raises :class:`InputError` when ``out`` holds what no import wrote, or these curves as of the other direction.
    """
    _refuse_other_way(out, results)
    inner = prepared(out, results.test, results.direction)
    record = statistics_text(
        results.test, results.direction, results.found, {what.key: value for what, value in results.conditions},
        sources=list(results.files), digests=list(results.digests),
    )  # fmt: skip
    table = table_text(
        out.resolve().name, results.direction, results.found, results.units, results.conditions, results.source(out)
    )
    write_atomic(inner / STATISTICS, record)
    write_atomic(out / table_name(results.test, results.direction), table)
    return inner


def _refuse_other_way(out: Path, results: Results) -> None:
    """Raise for curves that were imported for the other direction."""
    other = next((d for d in DIRECTIONS if d != results.direction), "")
    if not results.direction or not other:
        return
    folder = out / folder_name(results.test, other)
    if known_elsewhere(read_statistics(out).get(folder.name, {}), results.digests):
        raise InputError(
            f"--direction {results.direction}: these curves stand in {folder} already, imported as {other}: of which "
            f"direction are they? Remove that folder if they are of the {results.direction}"
        )
