"""Carries out ``knittest check``: models, times and counterparts of its runs, as lines or as JSON."""

import sys
import time as clock
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numba

from knittest.base.errors import OutOfTolerance
from knittest.base.kinds import kinds
from knittest.base.layout import width_of
from knittest.config.fabric import Fabric
from knittest.config.run import Run
from knittest.experiment.origin import borrowed
from knittest.kernels.threading import best_threads
from knittest.runs.preflight.model import (
    ModelFacts,
    estimate,
    model_facts,
    model_lines,
    rig_lines,
    rigs_of,
    rounded,
    speed_study,
)
from knittest.runs.preflight.of_tests import Counterpart, summary_line, table_lines, test_counterparts, with_owner
from knittest.runs.preflight.of_yarns import derived_lines, derived_numbers, yarn_counterparts
from knittest.runs.show import print_json, print_text
from knittest.runs.specimen import prepare


@dataclass(frozen=True)
class CheckOptions:
    """Options on what to leave out or add, and how to say it."""

    threads: int | None = None
    as_json: bool = False
    timed: bool = True
    convergence: bool = False
    folder: Path = Path("check")


def check_command(runs: Sequence[Run], options: CheckOptions, cells: Sequence[Run] = ()) -> int:
    """Check the models of ``runs`` and their fabric; returns the exit code.

    ``cells`` are paths of a cell of yarns from which a run derives the material card of its shells first.
    """
    numba.set_num_threads(best_threads(options.threads))
    passed, models = True, []
    card = _card(cells, options)
    _say(card, options)
    for run in runs if not cells else ():
        lines, found = _model(run, options)
        models.append(found)
        _say(lines, options)
        if options.convergence:
            study, converged = speed_study(run)
            found["converged"] = converged
            _say(study, options)
            passed = passed and converged
    rows = counterparts(runs[0].fabric)
    _say(derived_lines(runs[0].fabric), options)
    told = table_lines(rows, width_of(sys.stdout))
    _say([f"{runs[0].fabric.name}: its numbers beside what else is known of them", *told], options)
    _say([summary_line(rows), *taken_over(runs[0].fabric), *rig_lines(runs[0].fabric)], options)
    if options.as_json:
        print_json(
            {
                "models": models,
                "derived": {name: q.model_dump() for name, q in derived_numbers(runs[0].fabric).items()},
                "card": card,
                "counterparts": [row.as_json() for row in rows],
                "assumed_curves": borrowed(runs[0].fabric),
                "rigs": rigs_of(runs[0].fabric),
            }
        )
    return 0 if passed else OutOfTolerance.exit_code


def _card(cells: Sequence[Run], options: CheckOptions) -> list[str]:
    """Lines on the material card that is to be derived before there is a model of shells to be checked."""
    if not cells:
        return []
    name, parallel = cells[0].fabric.name, min(numba.get_num_threads(), len(cells))
    lines = [
        f"fabric {name} has no material card of the shells: a run at the macro scale first derives it from "
        f"{len(cells)} paths of a cell of its yarns, {parallel} at a time, and keeps it in the cache"
    ]
    if options.timed:
        times = [time.seconds for cell in cells if (time := estimate(cell, prepare(cell))) is not None]
        lines.append(f"  time                   about {rounded(sum(times) / parallel)}, once")
    return [*lines, "  model of the shells    can be checked when the card has been derived"]


def taken_over(fabric: Fabric) -> list[str]:
    """A line a curve of ``fabric`` that by its head is another fabric's, whatever the file says."""
    return [
        f"{field}: of {owner} by its head, so assumed for {fabric.name}" for field, owner in borrowed(fabric).items()
    ]


def counterparts(fabric: Fabric) -> list[Counterpart]:
    """All counterparts of the numbers of ``fabric``."""
    return [with_owner(row, fabric) for row in (*test_counterparts(fabric), *yarn_counterparts(fabric))]


def _model(run: Run, options: CheckOptions) -> tuple[list[str], ModelFacts]:
    kind = kinds()[run.rig.kind]
    checked, numbers = kind.load("checked")(run, options.folder) if kind.checked else ([], None)
    start = clock.perf_counter()
    prepared = prepare(run)
    spent = clock.perf_counter() - start
    facts = model_facts(run, prepared)
    if numbers is not None:
        facts["tools"] = numbers
    lines = [*model_lines(run, facts), *(f"  {'tools' if k == 0 else '':<23}{line}" for k, line in enumerate(checked))]
    if options.timed:
        time = estimate(run, prepared, spent)
        facts["estimate"] = None if time is None else time.as_json()
        said = "none: the number of steps that a strip takes to come to rest is not known beforehand"
        lines.append(f"  time                   {said if time is None else time.text()}")
    return lines, facts


def _say(lines: Sequence[str], options: CheckOptions) -> None:
    if not options.as_json:
        print_text(lines)
