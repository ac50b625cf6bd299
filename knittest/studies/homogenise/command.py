"""Command ``knittest homogenise``: tests of yarns, a card of the shells, tests of shells with it, a table and a picture
of both.
"""

import sys
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import knittest
from knittest.base.errors import InputError, KnittestError, NumericalError, OutOfTolerance, ResourceError
from knittest.base.figure import BLUE, ORANGE, Stamp, dress, new_figure, save, stamped
from knittest.base.files import write_atomic
from knittest.base.interrupts import Interrupts
from knittest.config.run import Run
from knittest.config.sources import numbers_of
from knittest.export.files import json_text
from knittest.export.lock import slug
from knittest.export.summary import now
from knittest.laboratory.cell.config import CellRun
from knittest.laboratory.report_base import size_of
from knittest.studies.homogenise.card import (
    FABRIC,
    Card,
    Tested,
    bending_stiffness,
    card_numbers,
    card_of,
    normalised,
    pulled,
    write_card,
)
from knittest.studies.homogenise.check import ANGLES, TOLERANCE, Row, compared
from knittest.studies.homogenise.plan import PIECES, Piece, Request, cell_run, cell_shell_run, shell_run, yarn_run
from knittest.studies.trials.pool import LocalPool, Pool
from knittest.studies.trials.runner import Studied, TrialRunner, says_how_to_go_on, study_folder
from knittest.studies.trials.trial import Record, code_digest, looser_note, trial_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes


#: said of every card of a cell
ALIKE = "yarns of a cell are all alike: strips of scattered yarns break at less force and strain than this card has"


@dataclass(frozen=True)
class Ended:
    """End of one run: ``scale`` yarns or shells, ``name`` of its test."""

    scale: str
    name: str
    record: Record


@dataclass
class Outcome:
    """Runs that ended, the card and its check; ``failure`` says why there is no card, and is empty where there is."""

    run: Run
    command: str
    ended: list[Ended] = field(default_factory=list)
    card: Card | None = None
    rows: Sequence[Row] = ()
    failure: str = ""

    @property
    def status(self) -> str:
        """Status in words."""
        if self.failure:
            return "no card"
        return "reproduced" if self.within else "not reproduced"

    @property
    def within(self) -> bool:
        """Tell whether shells with the card reproduce the yarns."""
        return not self.failure and bool(self.rows) and all(row.within for row in self.rows)

    @property
    def worst(self) -> Row | None:
        """The row of largest deviation."""
        return max(self.rows, key=lambda row: abs(row.deviation), default=None)


def as_data(outcome: Outcome) -> dict[str, object]:
    """Plain data of homogenise.json."""
    run = outcome.run
    return {
        "command": outcome.command,
        "fabric": run.fabric.name, "parameters": run.parameters, "preset": run.model.preset,
        "seed": run.variability.seed,
        "status": outcome.status, "reason": outcome.failure,
        "card": FABRIC if not outcome.failure else None,
        "numbers": card_numbers(outcome.card) if outcome.card else {},
        "tolerance_pct": TOLERANCE,
        "largest_deviation_pct": abs(outcome.worst.deviation) if outcome.worst else None,
        "check": [asdict(row) | {"within": row.within} for row in outcome.rows],
        "note": _note(run),
        "looser_limits": looser_note(one.record for one in outcome.ended),
        "runs": [_run(one) for one in outcome.ended],
        "version": knittest.__version__, "code": code_digest(), "written": now(),
    }  # fmt: skip


def _run(one: Ended) -> dict[str, object]:
    record = one.record
    return {
        "scale": one.scale, "test": one.name, "trial": record.key, "status": record.status, "reason": record.reason,
        "seconds": record.seconds, "cpu_s": record.cost["cpu_s"] if record.cost else None, "results": record.results,
    }  # fmt: skip


def report_lines(outcome: Outcome) -> list[str]:
    """Lines that the command prints at its end."""
    lines = [f"  {one.name} of {one.scale} {_brief(one.record)}" for one in outcome.ended if _lost(one.record)]
    lines += looser_note(one.record for one in outcome.ended)
    if outcome.failure:
        return [f"no card: {outcome.failure}", *lines]
    width = max(len(f"{row.test}, {row.quantity}") for row in outcome.rows)
    lines.append(f"{'':{width}}  {'yarns':>10}  {'shells':>10}  deviation")
    for row in outcome.rows:
        name, mark = f"{row.test}, {row.quantity}", "" if row.within else f"  more than {TOLERANCE:g} %"
        lines.append(
            f"{name:{width}}  {row.yarns:>10.5g}  {row.shells:>10.5g}  {row.deviation:>+7.2f} %  {row.unit}{mark}"
        )
    lines += [note] if (note := _note(outcome.run)) else []
    worst = outcome.worst
    if worst:
        lines.append(
            f"{outcome.status} within {TOLERANCE:g} %: largest deviation {worst.deviation:+.2f} %, {worst.test}, "
            f"{worst.quantity}"
        )
    return lines


def _note(run: Run) -> str:
    """Sentence on what a card of a cell overstates; of other cards empty."""
    return ALIKE if isinstance(run, CellRun) else ""


def _lost(record: Record) -> bool:
    return record.status != "completed"


def _brief(record: Record) -> str:
    return f"{record.status}: {record.reason}"


Pairs = dict[Piece, tuple[Tested, Tested]]


def homogenise_picture(outcome: Outcome, pairs: Pairs, path: Path) -> None:
    """Force over strain, over shear angle, and bending stiffnesses; ``pairs`` are yarns and shells of each test.

    Raises :class:`ResourceError`.
    """
    figure = new_figure(11.0, 7.2)
    panels = figure.subplots(2, 2).ravel()
    figure.subplots_adjust(left=0.08, right=0.97, bottom=0.08, top=0.86, wspace=0.22, hspace=0.42)
    curves = [piece for piece in pairs if piece.kind != "cantilever"]
    for axes, piece in zip(panels, curves, strict=False):
        _curves(axes, piece, *pairs[piece])
    _bent(panels[3], {piece: pair for piece, pair in pairs.items() if piece.kind == "cantilever"})
    run, worst = outcome.run, outcome.worst
    said = f"; largest deviation {worst.deviation:+.1f} %" if worst else ""
    numbers = numbers_of(run.parameters)
    title = f"{run.fabric.name} ({numbers}), {run.model.preset}: shells with the card made of yarns{said}"
    figure.suptitle(title, x=0.08, y=0.975, ha="left", va="top", fontsize=12)
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, frameon=False, fontsize=9.5, loc="upper left", bbox_to_anchor=(0.07, 0.945), ncols=2)
    tested = [f"{piece.name}: {', '.join(size_of(yarns.run))}" for piece, (yarns, _) in pairs.items()]
    facts = (run.fabric.name, f"parameters {numbers}", f"preset {run.model.preset}", *tested)
    with stamped(Stamp(facts, f"yarns {outcome.status} by shells with the card", bad=not outcome.within)):
        save(figure, path)


def _curves(axes: "Axes", piece: Piece, yarns: Tested, shells: Tested) -> None:
    dress(axes)
    axes.spines["right"].set_visible(False)
    tensile = piece.kind == "tensile"
    styles = (("yarns", BLUE, "-", 2.4), ("shells with the card", ORANGE, "--", 1.6))
    for test, (label, colour, dash, thick) in zip((yarns, shells), styles, strict=True):
        axes.plot(*(pulled if tensile else normalised)(test), dash, color=colour, linewidth=thick, label=label)
    axes.set_xlim(left=0.0)
    axes.set_ylim(bottom=0.0)
    if tensile:
        axes.set(xlabel="strain [%]", ylabel="force per width [N/mm]")
        axes.set_title(f"tension, {piece.direction}, up to the largest force", loc="left", fontsize=10.5)
    else:
        axes.set_xticks([0.0, *ANGLES])
        axes.set(xlabel="shear angle [deg]", ylabel="normalised force [N/mm]")
        axes.set_title("shear", loc="left", fontsize=10.5)


def _bent(axes: "Axes", pairs: Pairs) -> None:
    """Bending stiffness by direction as a pair of bars."""
    dress(axes)
    axes.spines["right"].set_visible(False)
    axes.grid(False, axis="x")
    for k, (yarns, shells) in enumerate(pairs.values()):
        for test, shift, colour in ((yarns, -0.17, BLUE), (shells, 0.17, ORANGE)):
            stiffness = bending_stiffness(test)
            axes.bar(k + shift, stiffness, 0.3, color=colour)
            axes.annotate(f"{stiffness:.2f}", (k + shift, stiffness), (0, 3), textcoords="offset points", ha="center")
    axes.set_xticks(range(len(pairs)), [str(piece.direction) for piece in pairs])
    axes.margins(y=0.15)
    axes.set_ylabel("bending stiffness [N mm]")
    axes.set_title("bending", loc="left", fontsize=10.5)


RESULT, PICTURE, REQUEST = "homogenise.json", "homogenise.png", "command.txt"


@dataclass(frozen=True)
class HomogeniseOptions:
    """Place of a homogenisation, the time [s] that a test of it may take, and what it reports."""

    out: Path | None = None
    workers: int | None = None
    threads: int | None = None
    time_limit: float = 7200.0
    json: bool = False
    quiet: bool = False


def homogenise_command(request: Request, options: HomogeniseOptions, command: str) -> int:
    """Homogenise, or go on with it; returns the exit code. Raises as :func:`run_homogenisation`."""
    return run_homogenisation(request, options, command).exit_code


def run_homogenisation(request: Request, options: HomogeniseOptions, command: str) -> Studied:
    """Homogenise, or go on with it; the exit code is 3 without a card, 5 where it does not reproduce the yarns.

    ``command`` is how it was called. Raises :class:`InputError` before anything runs.
    """
    made = cell_run if request.source == "cell" else yarn_run
    runs = {piece: made(request, piece) for piece in PIECES}
    pool = LocalPool(options.workers, options.threads)
    first = runs[PIECES[0]]
    of = "homogenise-cell" if request.source == "cell" else "homogenise"
    name = f"{of}-{slug(first.fabric.name)}-{slug(first.parameters)}-{first.model.preset}"
    folder = study_folder(options.out or Path("runs") / name, REQUEST, f"{command}\n", "homogenisation")
    outcome = Outcome(first, command)
    with says_how_to_go_on(), Interrupts() as interrupts, interrupts.deciding():
        for name in (FABRIC, RESULT, PICTURE):  # of an earlier card
            (folder / name).unlink(missing_ok=True)
        pairs = _work(runs, pool, folder, options, outcome)
        if pairs:
            homogenise_picture(outcome, pairs, folder / PICTURE)
        write_atomic(folder / RESULT, json_text(as_data(outcome)))
    return Studied(folder, _say(outcome, folder, options))


def _work(
    runs: dict[Piece, Run], pool: Pool, folder: Path, options: HomogeniseOptions, outcome: Outcome
) -> dict[Piece, tuple[Tested, Tested]]:
    """Run both scales and fill ``outcome``; the finished tests of both, by piece, empty where there is no card."""
    with TrialRunner(folder, pool, limit=options.time_limit) as runner:
        try:
            yarns = _tests(runs, runner, _scale(runs), options, outcome)
            outcome.card = card_of(yarns)
            card = write_card(outcome.card, folder, outcome.command)
            shells = _tests(_shell_runs(runs, card, outcome.card), runner, "shells", options, outcome)
        except (NumericalError, InputError) as error:
            (folder / FABRIC).unlink(missing_ok=True)
            outcome.card, outcome.failure = None, str(error)
            return {}
    pairs = {piece: (yarns[piece], shells[piece]) for piece in runs}
    outcome.rows = [row for piece, pair in pairs.items() for row in compared(piece, *pair)]
    return pairs


def _scale(runs: dict[Piece, Run]) -> str:
    return "cell" if isinstance(runs[PIECES[0]], CellRun) else "yarns"


def _shell_runs(runs: dict[Piece, Run], card: Path, made: Card) -> dict[Piece, Run]:
    last = float(made.shear[0][-1])
    if _scale(runs) == "cell":
        return {piece: cell_shell_run(piece, run, card, last, made.bending) for piece, run in runs.items()}
    return {piece: shell_run(piece, run, card, last) for piece, run in runs.items()}


def _tests(
    runs: dict[Piece, Run], runner: TrialRunner, scale: str, options: HomogeniseOptions, outcome: Outcome
) -> dict[Piece, Tested]:
    """The tests of one scale, run or found in the ledger; raises :class:`NumericalError` when one has no result."""
    trials = {piece: trial_of(run, f"{piece.name} of {scale}") for piece, run in runs.items()}
    pieces = {trial.key: piece for piece, trial in trials.items()}
    records = {}
    for record in runner.run(list(trials.values())):
        piece = pieces[record.key]
        records[piece] = record
        outcome.ended.append(Ended(scale, piece.name, record))
        if not options.quiet:
            with suppress(OSError):
                said = f": {record.reason}" if record.reason else ""
                text = f"{piece.name} of {scale}: {record.status}{said} ({record.seconds:.1f} s)"
                print(text, file=sys.stderr, flush=True)
        if record.status == "blocked":
            raise ResourceError(f"{record.reason}; what is finished is kept, run the same command again to go on")
    lost = [f"{piece.name} {r.status}: {r.reason}" for piece, r in records.items() if r.status != "completed"]
    if lost:
        raise NumericalError(f"{scale}: {'; '.join(lost)}")
    return {p: Tested(runs[p], runner.place(trials[p]), records[p].results, trials[p].key) for p in runs}


def _say(outcome: Outcome, folder: Path, options: HomogeniseOptions) -> int:
    if options.json:
        print(json_text(as_data(outcome)), end="")
    elif not options.quiet:
        files = [RESULT] if outcome.failure else [FABRIC, RESULT, PICTURE]
        for line in [*report_lines(outcome), f"written: {', '.join(str(folder / name) for name in files)}"]:
            print(line)
    error: type[KnittestError] = NumericalError if outcome.failure else OutOfTolerance
    return 0 if outcome.within else error.exit_code
