"""Contents of a run folder as data: its curve, results, gates and pictures."""

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from knittest.api.shown import Shown, show_views
from knittest.base.errors import InputError
from knittest.base.summary import Summary
from knittest.runs.opening import manifest_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from pandas import DataFrame

DIRECTIONS = ("warp", "weft")


@dataclass(frozen=True)
class Gates:
    """The quality gates of a run: whether it passed, its numbers [-], why it was refused, and what to look at.

    True as a condition where all gates passed, so that ``if run.gates:`` asks what it seems to ask.
    """

    passed: bool
    values: dict[str, float | bool]
    refused: list[str]
    warnings: list[str]

    def __bool__(self) -> bool:
        return self.passed


class Run:
    """One run folder. Names of columns and results end with their unit: ``strain_pct``, ``peak_force_n``, ``time_ms``.

    ``folder`` is its path. What only a completed run has raises :class:`InputError` for another.
    """

    def __init__(self, folder: PathLike[str] | str) -> None:
        """Raises :class:`InputError` where ``folder`` is no run folder."""
        self.folder = Path(folder)
        self._manifest = manifest_of(self.folder)

    def __repr__(self) -> str:
        verdict = ""
        if self.status == "completed":
            verdict = ", gates passed" if self.gates else ", comparison REFUSED by its gates"
        return f"<knittest.Run {self.folder}: {self.status}{verdict}>"

    @property
    def status(self) -> str:
        """State of the run: running, completed, failed or interrupted."""
        return str(self._manifest["status"])

    @cached_property
    def summary(self) -> Summary:
        """Contents of summary.json: results with their units, comparison with the experiment, gates, cost [s]."""
        if self.status != "completed":
            message = f"{self.folder}: the run is {self.status}: it has no results"
            raise InputError(f"{message}; go on with it: knittest.resume({str(self.folder)!r})")
        path = self.folder / "summary.json"
        try:
            found: Summary = json.loads(path.read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            raise InputError(f"{path}: cannot be read: {error}") from None
        return found

    @property
    def results(self) -> dict[str, Any]:
        """Results by name, each ending with its unit; of an ensemble mean, sd and values."""
        return self.summary["results"]

    @property
    def gates(self) -> Gates:
        """Verdict of the quality gates."""
        found = self.summary
        return Gates(not found["refused"], found["quality"], found["refused"], found["warnings"])

    @property
    def curve(self) -> "DataFrame":
        """Columns of curve.csv, one row a sample; each ends with its unit (time_ms, strain_pct, force_n)."""
        return self._table("curve.csv")

    @property
    def energies(self) -> "DataFrame":
        """Columns of energies.csv [mJ], one row a sample."""
        return self._table("energies.csv")

    def plot(self, ax: "Axes | None" = None) -> "Axes":
        """Draw the curve on ``ax``, else on axes of its own; the labels of the axes have the units."""
        from knittest.laboratory.report_base import REPORTS

        axes = REPORTS[self.summary["rig"]].axes
        curve = self.curve
        y = axes.mean if axes.mean in curve else axes.y
        if ax is None:
            from matplotlib import pyplot

            ax = pyplot.subplots()[1]
        label = self.summary["direction"] or self.summary["rig"]
        ax.plot(curve[axes.x], curve[y], label=label if self.gates else f"{label} (refused by its gates)")
        ax.set(xlabel=axes.xlabel, ylabel=axes.ylabel)
        if axes.logarithmic:
            ax.set_xscale("log")
        ax.legend()
        return ax

    def show(self) -> Shown | None:
        """Moving view of the run, ``view.html``: in a notebook an object that it displays, else in the browser.

        Raises :class:`InputError` where the run was made without frames.
        """
        return show_views([self.folder])

    def animate(self, out: PathLike[str] | str, **looks: Any) -> Path:
        """Write the run as the film ``out``, .mp4 or .gif; ``colour``, ``look``, ``seconds``, ``fps``, ``width`` [px],
        ``tools`` or not.

        Raises :class:`InputError` where the run was made without frames, and for what no film can be made of.
        """
        from knittest.report_page.moving.film import Filmed, animate

        return animate(self.folder, Path(out), Filmed(**looks))

    def _table(self, name: str) -> "DataFrame":
        if self.status != "completed":
            _ = self.summary  # says why there is none
        import pandas

        try:
            return pandas.read_csv(self.folder / name, comment="#")
        except (OSError, ValueError) as error:
            raise InputError(f"{self.folder / name}: cannot be read: {error}") from None


class Runs(Sequence[Run]):
    """Runs of one call, warp and weft, in ``folder``; ``runs.warp`` is that of the warp.

    ``curve`` and ``energies`` are those of all runs with the direction in front; the others are dicts by direction.
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
    def gates(self) -> Gates:
        """Verdict over all runs: passed where all passed; numbers and reasons have their direction in front."""
        found = {name: run.gates for name, run in self._runs.items()}
        return Gates(
            all(gates.passed for gates in found.values()),
            {f"{name}.{key}": value for name, gates in found.items() for key, value in gates.values.items()},
            [f"{name}: {text}" for name, gates in found.items() for text in gates.refused],
            [f"{name}: {text}" for name, gates in found.items() for text in gates.warnings],
        )

    @property
    def curve(self) -> "DataFrame":
        """Curves of all runs, one row a sample, ``direction`` in front; columns end with their unit."""
        import pandas

        return pandas.concat([run.curve.assign(direction=name) for name, run in self._runs.items()]).pipe(_in_front)

    @property
    def energies(self) -> "DataFrame":
        """Energies of all runs [mJ], ``direction`` in front."""
        import pandas

        return pandas.concat([run.energies.assign(direction=name) for name, run in self._runs.items()]).pipe(_in_front)

    def plot(self, ax: "Axes | None" = None) -> "Axes":
        """Draw the curves of all runs on one pair of axes."""
        for run in self:
            ax = run.plot(ax)
        assert ax is not None
        return ax

    def show(self) -> Shown | None:
        """Show the runs, one below the other; see :meth:`Run.show`."""
        return show_views([run.folder for run in self])


def load(folder: PathLike[str] | str) -> Run | Runs:
    """Read an existing run folder, or the folder of both directions.

    Raises :class:`InputError` where it is none, or a direction that was planned has not begun.
    """
    path = Path(folder)
    if (path / "manifest.json").is_file():
        return Run(path)
    planned = [name for name in DIRECTIONS if (path / f"config-{name}.yaml").is_file()]
    if not planned:
        raise InputError(f"{path}: not a run folder: it has no manifest.json")
    return Runs(path, [Run(path / name) for name in planned])


def _in_front(table: "DataFrame") -> "DataFrame":
    """The table with its column ``direction`` first, rows numbered anew."""
    return table[["direction", *(name for name in table if name != "direction")]].reset_index(drop=True)
