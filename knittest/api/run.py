"""Contents of a run folder as data: curve, results, quality checks and pictures."""

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from knittest.api.notebook_view import NotebookPages, show_views
from knittest.base.errors import InputError
from knittest.base.summary import Summary
from knittest.config.aliases import warn_of_old_name
from knittest.runs.opened_run import manifest_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from pandas import DataFrame

DIRECTIONS = ("warp", "weft")


@dataclass(frozen=True)
class QualityChecks:
    """Quality checks of a run: verdict, values [-], reasons of failure and warnings; true if all passed."""

    passed: bool
    values: dict[str, float | bool]
    refused: list[str]
    warnings: list[str]

    def __bool__(self) -> bool:
        return self.passed


Gates = QualityChecks  # old name, until 0.4


class _OldNames:
    """Attribute of runs by its old name, which is read for one more version."""

    @property
    def gates(self) -> QualityChecks:
        """Old name of ``quality_checks``."""
        warn_of_old_name(f"knittest.{type(self).__name__}", "gates", "quality_checks")
        return self.quality_checks  # type: ignore[attr-defined, no-any-return]


class Run(_OldNames):
    """Run folder. Names of columns and results end with their unit: ``strain_pct``, ``peak_force_n``, ``time_ms``.

    Attributes of completed runs raise :class:`InputError` for other runs.
    """

    def __init__(self, folder: PathLike[str] | str) -> None:
        """Raises :class:`InputError` if ``folder`` is no run folder."""
        self.folder = Path(folder)
        self._manifest = manifest_of(self.folder)

    def __repr__(self) -> str:
        verdict = ""
        if self.status == "completed":
            verdict = ", quality checks passed" if self.quality_checks else ", quality checks FAILED"
        return f"<knittest.Run {self.folder}: {self.status}{verdict}>"

    @property
    def status(self) -> str:
        """Status of the run: running, completed, failed or interrupted."""
        return str(self._manifest["status"])

    @cached_property
    def summary(self) -> Summary:
        """Contents of summary.json: results with units, comparison with the experiment, quality checks, cost [s]."""
        if self.status != "completed":
            remedy = f"resume it: knittest.resume({str(self.folder)!r})"
            raise InputError(f"{self.folder}: the run is {self.status} and has no results; {remedy}")
        path = self.folder / "summary.json"
        try:
            found: Summary = json.loads(path.read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            raise InputError(f"{path} cannot be read: {error}") from None
        return found

    @property
    def results(self) -> dict[str, Any]:
        """Results by name, which ends with the unit; mean, sd and values of an ensemble."""
        return self.summary["results"]

    @property
    def quality_checks(self) -> QualityChecks:
        """Quality checks of the run."""
        found = self.summary
        return QualityChecks(not found["refused"], found["quality"], found["refused"], found["warnings"])

    @property
    def curve(self) -> "DataFrame":
        """Columns of curve.csv, one row per sample; names end with the unit (time_ms, strain_pct, force_n)."""
        return self._table("curve.csv")

    @property
    def energies(self) -> "DataFrame":
        """Columns of energies.csv [mJ], one row per sample."""
        return self._table("energies.csv")

    def plot(self, ax: "Axes | None" = None) -> "Axes":
        """Draw the curve on ``ax``, or on new axes; the labels of the axes have the units."""
        from knittest.laboratory.report_base import REPORTS

        axes = REPORTS[self.summary["rig"]].axes
        curve = self.curve
        y = axes.mean if axes.mean in curve else axes.y
        if ax is None:
            from matplotlib import pyplot

            ax = pyplot.subplots()[1]
        label = self.summary["direction"] or self.summary["rig"]
        ax.plot(curve[axes.x], curve[y], label=label if self.quality_checks else f"{label} (failed quality checks)")
        ax.set(xlabel=axes.xlabel, ylabel=axes.ylabel)
        if axes.logarithmic:
            ax.set_xscale("log")
        ax.legend()
        return ax

    def show(self) -> NotebookPages | None:
        """Show the 3D view of the run, ``view.html``, in the notebook, else in the browser.

        Raises :class:`InputError` for a run without frames.
        """
        return show_views([self.folder])

    def animate(self, out: PathLike[str] | str, **looks: Any) -> Path:
        """Write the film ``out``, .mp4 or .gif; ``looks``: ``colour``, ``look``, ``seconds``, ``fps``, ``width`` [px],
        ``tools``.

        Raises :class:`InputError` for a run without frames and for bad options.
        """
        from knittest.report_page.moving.film import FilmOptions, animate

        return animate(self.folder, Path(out), FilmOptions(**looks))

    def _table(self, name: str) -> "DataFrame":
        if self.status != "completed":
            _ = self.summary  # raises the reason
        import pandas

        try:
            return pandas.read_csv(self.folder / name, comment="#")
        except (OSError, ValueError) as error:
            raise InputError(f"{self.folder / name} cannot be read: {error}") from None


class Runs(_OldNames, Sequence[Run]):
    """Runs of one call, warp and weft, in ``folder``; ``runs.warp`` is that of the warp.

    ``curve`` and ``energies`` join all runs with a column ``direction``; other attributes are dicts by direction.
    """

    def __init__(self, folder: PathLike[str] | str, runs: Sequence[Run]) -> None:
        self.folder = Path(folder)
        self._runs = {run.folder.name: run for run in runs}

    def __getitem__(self, key: Any) -> Any:
        return self._runs[key] if isinstance(key, str) else list(self._runs.values())[key]

    def __len__(self) -> int:
        return len(self._runs)

    def __iter__(self) -> Iterator[Run]:
        return iter(self._runs.values())

    def __getattr__(self, name: str) -> Run:
        if name in DIRECTIONS and name in self._runs:
            return self._runs[name]
        raise AttributeError(f"'Runs' object has no attribute {name!r}", name=name, obj=self)

    def __repr__(self) -> str:
        return f"<knittest.Runs {self.folder}: {', '.join(map(repr, self))}>"

    @property
    def summary(self) -> dict[str, Summary]:
        """Contents of summary.json by direction."""
        return {name: run.summary for name, run in self._runs.items()}

    @property
    def results(self) -> dict[str, dict[str, Any]]:
        """Results by direction and name, each ending with its unit."""
        return {name: run.results for name, run in self._runs.items()}

    @property
    def quality_checks(self) -> QualityChecks:
        """Quality checks of all runs, which pass if all runs do; numbers and reasons begin with the direction."""
        found = {name: run.quality_checks for name, run in self._runs.items()}
        return QualityChecks(
            all(checks.passed for checks in found.values()),
            {f"{name}.{key}": value for name, checks in found.items() for key, value in checks.values.items()},
            [f"{name}: {text}" for name, checks in found.items() for text in checks.refused],
            [f"{name}: {text}" for name, checks in found.items() for text in checks.warnings],
        )

    @property
    def curve(self) -> "DataFrame":
        """Curves of all runs, one row per sample, first column ``direction``; names of columns end with the unit."""
        return self._joined("curve")

    @property
    def energies(self) -> "DataFrame":
        """Energies of all runs [mJ], first column ``direction``."""
        return self._joined("energies")

    def _joined(self, name: str) -> "DataFrame":
        import pandas

        tables = {direction: getattr(run, name) for direction, run in self._runs.items()}
        return pandas.concat(tables, names=["direction"]).reset_index(level=0).reset_index(drop=True)

    def plot(self, ax: "Axes | None" = None) -> "Axes":
        """Draw the curves of all runs on the same axes."""
        for run in self:
            ax = run.plot(ax)
        assert ax is not None
        return ax

    def show(self) -> NotebookPages | None:
        """Show the 3D views of all runs; see :meth:`Run.show`."""
        return show_views([run.folder for run in self])


def load(folder: PathLike[str] | str) -> Run | Runs:
    """Load a run folder, or the folder of both directions; raises :class:`InputError` for another folder."""
    path = Path(folder)
    if (path / "manifest.json").is_file():
        return Run(path)
    planned = [name for name in DIRECTIONS if (path / f"config-{name}.yaml").is_file()]
    if not planned:
        raise InputError(f"{path}: not a run folder: it has no manifest.json")
    return Runs(path, [Run(path / name) for name in planned])
