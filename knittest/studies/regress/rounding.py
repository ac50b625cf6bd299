"""Scatter of a run by rounding: its numbers and curve over runs whose time steps differ by billionths.

Folding sheets and yarns that stick and slip enlarge rounding as far as their states go, and processors, compilers and
libraries round differently. A change of the step by 1e-9 is far below what the step itself costs in exactness, and any
change of it above rounding shows the same scatter.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from knittest.config.run import Run
from knittest.studies.regress.baseline import Entry
from knittest.studies.regress.cases import Case, trial_here
from knittest.studies.regress.recorded import points, rounded
from knittest.studies.trials.trial import Trial

#: runs whose mean and scatter are stored, the one as it is among them
RUNS = 12
#: part by which the step of each is shorter than that of the one before
SHORTER = 1e-9
#: standard deviations that a number may be off the mean: with 12 runs, one in 2000 of a normal scatter is
TIMES = 5.0


def otherwise_rounded(case: Case, trial: Trial) -> list[Trial]:
    """The runs beside ``trial`` by which the scatter of ``case`` is known; none where it does not enlarge rounding."""
    if not case.enlarges:
        return []
    return [trial_here(_shorter(trial.run, number), f"{case.name}, rounding {number}") for number in range(1, RUNS)]


def pooled(entry: Entry, others: Sequence[Entry], curves: Sequence[tuple[Run, Path]], crests: Sequence[str]) -> Entry:
    """``entry`` with the mean of its numbers and those of ``others``, its curve of ``curves`` (runs and folders) too,
    their standard deviations, and the range of what counts ``crests``; numbers that one of them lacks are named alone.
    Raises :class:`InputError` for a lost curve.
    """
    together = [entry.results, *(other.results for other in others)]
    names = [name for name in entry.results if all(name in one for one in together)]
    values = np.array([[one[name] for name in names] for one in together])
    results, scatter = (dict(zip(names, _digits(row), strict=True)) for row in _mean_sd(values))
    ranges = {name: (int(min(row)), int(max(row))) for name, row in zip(names, values.T, strict=True) if name in crests}
    update: dict[str, object] = {
        "runs": len(together),
        "results": results,
        "scatter": {name: sd for name, sd in scatter.items() if name not in crests},
        "ranges": ranges,
        "sometimes": sorted({name for one in together for name in one} - {*names}),
    }
    if entry.curve is not None:
        grid = entry.curve.x
        y = np.array([entry.curve.y, *(np.interp(grid, *points(run, folder)) for run, folder in curves)])
        mean, sd = map(_digits, _mean_sd(y))
        update["curve"] = entry.curve.model_copy(update={"y": mean, "scatter": sd})
    return entry.model_copy(update=update)


def _shorter(run: Run, number: int) -> Run:
    solver = run.solver.model_copy(update={"safety": run.solver.safety * (1.0 - number * SHORTER)})
    return run.model_copy(update={"solver": solver})


def _mean_sd(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return values.mean(axis=0), values.std(axis=0, ddof=1)


def _digits(values: np.ndarray) -> list[float]:
    return [rounded(float(v)) for v in values]
