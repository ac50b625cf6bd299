"""Picture convergence.png: the course of the search."""

import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from knittest.base.figure import BLUE, GREEN, GREY, ORANGE, Stamp, new_figure, save, use_stamp
from knittest.base.result_rows import LABELS
from knittest.laboratory.report_base import size_of
from knittest.studies.calibrate.outcome import Outcome
from knittest.studies.calibrate.targets import NumberTarget
from knittest.studies.trials.figure import COLOURS, DASHED, dress_panel, log_scale, mark_lost_runs, unit_label

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: columns of the legend of parameters
LEGEND_COLUMNS = 2


def convergence_picture(outcome: Outcome, path: Path) -> None:
    """Draw deviations, and response or parameters, over the search; raises :class:`ResourceError`."""
    more = 0.2 * ((len(outcome.problem.parameters) - 1) // LEGEND_COLUMNS)  # inches for further rows of the legend
    height = 4.6 + more
    figure = new_figure(10.0, height)
    left, right = figure.subplots(1, 2)
    top = 1.0 - (0.83 + more) / height
    figure.subplots_adjust(left=0.08, right=0.97, bottom=0.6 / height, top=top, wspace=0.26)
    _draw_deviations(dress_panel(left), outcome)
    dress_panel(right)
    target = outcome.problem.targets[0]
    if len(outcome.problem.parameters) == len(outcome.problem.targets) == 1 and isinstance(target, NumberTarget):
        _draw_response(right, outcome, target)
    else:
        _draw_values(right, outcome)
    state = "converged" if outcome.converged else "NOT converged"
    title = f"{outcome.problem.name}: {state}, {outcome.runs} runs"
    figure.suptitle(title, x=0.08, y=1.0 - 0.18 / height, ha="left", va="top", fontsize=12)
    facts = []
    for case in outcome.problem.cases:
        run = case.run()
        test = " ".join(filter(None, (run.rig.kind, run.direction)))
        sizes = ", ".join(size_of(run))
        facts.append(f"{run.fabric.name}, {test}, {run.model.scale}, preset {run.model.preset}, {sizes}")
    verdict = "" if outcome.converged else f"not converged: {outcome.failure}"
    with use_stamp(Stamp(facts, verdict, bad=not outcome.converged)):
        save(figure, path)


def _draw_deviations(axes: "Axes", outcome: Outcome) -> None:
    """Draw the largest deviation at each point, the best so far, and the tolerance."""
    from matplotlib.ticker import MaxNLocator

    numbers = np.arange(1, len(outcome.history) + 1)
    floor = 0.1 * outcome.problem.calibration.tolerance
    largest = [np.abs(one.deviations).max() if one.deviations is not None else np.nan for one in outcome.history]
    found = np.maximum(largest, floor)
    good = np.isfinite(found)
    axes.plot(numbers[good], found[good], "o", color=BLUE, markersize=5, label="largest of the targets")
    if good.any():
        best = np.fmin.accumulate(np.where(good, found, math.inf))
        axes.step(numbers[good], best[good], where="post", color=BLUE, linewidth=1.2, alpha=0.6, label="best so far")
    else:
        axes.set_ylim(floor, 100.0 * floor)  # the tolerance alone is no range
    tolerance = outcome.problem.calibration.tolerance
    axes.axhline(tolerance, color=GREY, linewidth=1.0, linestyle=DASHED, label="tolerance")
    mark_lost_runs(axes, numbers[~good], label="no result")
    axes.set_yscale("log")
    axes.yaxis.set_major_formatter("{x:g}")
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set(xlabel="point of the search", ylabel="deviation [sd], at least tolerance/10")
    axes.legend(frameon=False, fontsize=8.5, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=4, borderaxespad=0.2)


def _draw_response(axes: "Axes", outcome: Outcome, target: NumberTarget) -> None:
    """Draw the result over the parameter, the target, and the value found with its interval."""
    (parameter,) = outcome.problem.parameters
    good = sorted((one.values[0], one.simulated[0]) for one in outcome.history if one.good)
    mean, sd = target.mean, target.sd
    axes.axhspan(mean - sd, mean + sd, color=ORANGE, alpha=0.12, linewidth=0)
    axes.axhline(mean, color=ORANGE, linewidth=1.2, linestyle=DASHED, label="target, mean ± sd")
    axes.plot([x for x, _ in good], [y for _, y in good], "o-", color=BLUE, markersize=5, linewidth=1.0, label="runs")
    if outcome.best and outcome.estimates:
        low, high = outcome.estimates.found[0].interval
        axes.axvspan(low, high, color=GREEN, alpha=0.08, linewidth=0)
        value = outcome.best.values[0]
        axes.axvline(value, color=GREEN, linewidth=1.4, label=f"found: {value:.4g}, 95 %")
    mark_lost_runs(axes, np.array([one.values[0] for one in outcome.history if not one.good]), label="no result")
    if parameter.log:
        log_scale(axes.xaxis, (1.0, 2.0, 3.0, 5.0))
    axes.set_xlabel(f"{parameter.name}{unit_label(parameter.unit)}")
    axes.set_ylabel(LABELS.get(target.quantity, (target.quantity,))[0])
    axes.legend(frameon=False, fontsize=8.5, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3, borderaxespad=0.2)


def _draw_values(axes: "Axes", outcome: Outcome) -> None:
    """Draw each parameter between its bounds, point by point, with its interval at the end."""
    from matplotlib.ticker import MaxNLocator

    numbers = np.arange(1, len(outcome.history) + 1)
    good = np.array([one.good for one in outcome.history], bool)
    for k, parameter in enumerate(outcome.problem.parameters):
        colour = COLOURS[k % len(COLOURS)]
        positions = np.array([parameter.position(one.values[k]) for one in outcome.history])
        value = f": {outcome.best.values[k]:.4g}" if outcome.best else ""
        name = ".".join(parameter.name.split(".")[-2:])
        label = f"{name}{value}"
        axes.plot(numbers[good], positions[good], "o-", color=colour, markersize=4, linewidth=1.0, label=label)
        if outcome.estimates and outcome.best:
            ends = [parameter.position(v) for v in outcome.estimates.found[k].interval]
            here = parameter.position(outcome.best.values[k])
            at, off = numbers[-1] + 0.6 + 0.35 * k, [[here - ends[0]], [ends[1] - here]]
            axes.errorbar([at], [here], off, fmt="s", color=colour, capsize=3, markersize=5)
    mark_lost_runs(axes, numbers[~good], label="no result")
    axes.set_ylim(-0.06, 1.06)
    axes.set_yticks([0.0, 0.5, 1.0], ["low", "middle", "high"])
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set(xlabel="point of the search; squares: found, 95 %", ylabel="value between its bounds")
    axes.legend(
        frameon=False, fontsize=8, loc="lower left", bbox_to_anchor=(-0.13, 1.0), ncols=LEGEND_COLUMNS,
        borderaxespad=0.2, columnspacing=1.2,
    )  # fmt: skip
