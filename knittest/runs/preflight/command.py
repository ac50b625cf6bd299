"""Carries out ``knittest check``: models and run times, and the counterparts of the fabric, as lines or as JSON."""

import sys
import time as clock
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numba

from knittest.base.errors import OutOfTolerance
from knittest.base.kinds import kinds
from knittest.base.layout import width_of
from knittest.config.fabric import Fabric
from knittest.config.run import Run
from knittest.experiment.origin import borrowed_curves
from knittest.kernels.threading import best_threads
from knittest.runs.preflight.measured_counterparts import (
    Counterpart,
    add_owner,
    summary_line,
    table_lines,
    test_counterparts,
)
from knittest.runs.preflight.model import (
    PROGRAM,
    duration_text,
    estimate,
    model_facts,
    model_lines,
    rig_lines,
    rigs_of,
    speed_study,
)
from knittest.runs.preflight.yarn_counterparts import derived_lines, derived_numbers, yarn_counterparts
from knittest.runs.specimen import prepare
from knittest.runs.terminal_output import print_json, print_text


@dataclass(frozen=True)
class CheckOptions:
    """Options of ``knittest check``."""

    threads: int | None = None
    as_json: bool = False
    timed: bool = True
    convergence: bool = False
    folder: Path = Path("check")


def check_command(runs: Sequence[Run], options: CheckOptions, cells: Sequence[Run] = ()) -> int:
    """Check the models of ``runs`` and their fabric; ``cells`` derive its macro card first. Returns the exit code."""
    numba.set_num_threads(best_threads(options.threads))
    say = (lambda lines: None) if options.as_json else print_text
    passed, models, fabric = True, [], runs[0].fabric
    card = _card_lines(cells, options)
    say(card)
    for run in runs if not cells else ():
        lines, facts = _check_model(run, options)
        models.append(facts)
        say(lines)
        if options.convergence:
            study, converged = speed_study(run)
            facts["converged"] = converged
            say(study)
            passed = passed and converged
    rows = counterparts(fabric)
    say(derived_lines(fabric))
    say([f"{fabric.name}: values of the fabric file and their counterparts", *table_lines(rows, width_of(sys.stdout))])
    say([summary_line(rows), *borrowed_curve_lines(fabric), *rig_lines(fabric)])
    if options.as_json:
        print_json(
            {
                "models": models,
                "derived": {name: q.model_dump() for name, q in derived_numbers(fabric).items()},
                "card": card,
                "counterparts": [row.as_json() for row in rows],
                "assumed_curves": borrowed_curves(fabric),
                "rigs": rigs_of(fabric),
            }
        )
    return 0 if passed else OutOfTolerance.exit_code


def _card_lines(cells: Sequence[Run], options: CheckOptions) -> list[str]:
    if not cells:
        return []
    name, parallel = cells[0].fabric.name, min(numba.get_num_threads(), len(cells))
    lines = [
        f"fabric {name} has no macro material card: a macro run first derives it from {len(cells)} simulations of a "
        f"meso cell, {parallel} in parallel, and caches it"
    ]
    if options.timed:
        times = [PROGRAM + time.specimens_s for cell in cells if (time := estimate(cell, prepare(cell))) is not None]
        lines.append(
            f"  time                   about {duration_text(sum(times) / parallel)}, once; up to ten times as "
            "long where paths restart at a lower speed, or fail a quality check and are repeated"
        )
    return [*lines, "  macro model            can be checked after a macro run has derived the card"]


def borrowed_curve_lines(fabric: Fabric) -> list[str]:
    """A line for each curve of ``fabric`` whose header names another fabric."""
    return [
        f"{field}: its header names {owner}, so it is assumed for {fabric.name}"
        for field, owner in borrowed_curves(fabric).items()
    ]


def counterparts(fabric: Fabric) -> list[Counterpart]:
    """All counterparts of the values of ``fabric``."""
    return [add_owner(row, fabric) for row in (*test_counterparts(fabric), *yarn_counterparts(fabric))]


def _check_model(run: Run, options: CheckOptions) -> tuple[list[str], dict[str, Any]]:
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
        unknown = "no estimate: the number of steps to static equilibrium is not known beforehand"
        lines.append(f"  time                   {unknown if time is None else time.text()}")
    return lines, facts
