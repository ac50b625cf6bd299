"""Command ``knittest homogenise``: tests of yarns, a card of the shells, tests of shells with it, a table of both."""

import sys
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from knittest.base.atomic import write_atomic
from knittest.base.errors import InputError, KnittestError, NumericalError, OutOfTolerance, ResourceError
from knittest.base.interrupts import Interrupts
from knittest.config.run import Run
from knittest.export.jsonfile import json_text
from knittest.export.names import slug
from knittest.laboratory.cell.config import CellRun
from knittest.studies.homogenise.card import FABRIC, Card, card_of, write_card
from knittest.studies.homogenise.check import compared
from knittest.studies.homogenise.from_cell import cell_run, cell_shell_run
from knittest.studies.homogenise.measures import Tested
from knittest.studies.homogenise.outcome import Ended, Outcome, as_data, report_lines
from knittest.studies.homogenise.picture import homogenise_picture
from knittest.studies.homogenise.plan import PIECES, Piece, Request, shell_run, yarn_run
from knittest.studies.trials.pool import LocalPool, Pool
from knittest.studies.trials.runner import TrialRunner
from knittest.studies.trials.study import Studied, says_how_to_go_on, study_folder
from knittest.studies.trials.trial import trial_of

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
