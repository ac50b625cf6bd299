"""Command ``knittest homogenise``: meso runs, a macro material card from them, macro runs with the card, table and
picture of both.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import knittest
from knittest.base.errors import InputError, NumericalError, OutOfTolerance, ResourceError
from knittest.base.figure import BLUE, ORANGE, Stamp, new_figure, save, use_stamp
from knittest.base.files import write_atomic
from knittest.config.run import Run
from knittest.config.sources import parameter_set_text
from knittest.export.files import json_text
from knittest.export.lock import slug
from knittest.export.summary import timestamp
from knittest.laboratory.cell.config import CellRun
from knittest.laboratory.report_base import size_of
from knittest.studies.homogenise import card as cards
from knittest.studies.homogenise.card import FABRIC, FinishedTest, MacroCard
from knittest.studies.homogenise.check import ANGLES, TOLERANCE, ScaleRow, compare_scales
from knittest.studies.homogenise.plan import (
    REPEATED,
    PlannedTest,
    Request,
    cell_macro_run,
    cell_run,
    is_coupled,
    macro_run,
    meso_run,
    planned_tests,
)
from knittest.studies.trials.figure import dress_panel
from knittest.studies.trials.pool import LocalPool
from knittest.studies.trials.runner import (
    RESUME_HINT,
    TRIALS,
    StudyOptions,
    StudyResult,
    handle_signals,
    run_with_overview,
    study_folder,
)
from knittest.studies.trials.trial import Record, code_digest, relaxed_limits_note, trial_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes


#: note on every card of a cell
EQUAL_YARNS = "all yarns of a cell are equal: strips with scatter fail at a lower force and strain than this card"
#: scales of homogenise.json in messages
SCALES = {"yarns": "meso", "shells": "macro", "cell": "cell"}


@dataclass(frozen=True)
class TestOutcome:
    """Outcome of one run: ``scale`` is a key of :data:`SCALES`, ``name`` that of its test."""

    scale: str
    name: str
    record: Record


@dataclass
class Outcome:
    """Finished runs, the card and its check; ``failure`` says why there is no card, and is empty if there is one."""

    run: Run
    command: str
    ended: list[TestOutcome] = field(default_factory=list)
    card: MacroCard | None = None
    rows: Sequence[ScaleRow] = ()
    failure: str = ""

    @property
    def status(self) -> str:
        """Status in words."""
        if self.failure:
            return "no card"
        return "reproduced" if self.is_within_tolerance else "not reproduced"

    @property
    def is_within_tolerance(self) -> bool:
        """Tell whether the macro model with the card reproduces the meso model."""
        return not self.failure and bool(self.rows) and all(row.is_within_tolerance for row in self.rows)

    @property
    def note(self) -> str:
        """Limit of a card of a cell; empty for other cards."""
        return EQUAL_YARNS if isinstance(self.run, CellRun) else ""

    @property
    def worst(self) -> ScaleRow | None:
        """Row of largest deviation."""
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
        "numbers": cards.card_numbers(outcome.card) if outcome.card else {},
        "tolerance_pct": TOLERANCE,
        "largest_deviation_pct": abs(outcome.worst.deviation) if outcome.worst else None,
        "check": [asdict(row) | {"within": row.is_within_tolerance} for row in outcome.rows],
        "note": outcome.note,
        "looser_limits": relaxed_limits_note(one.record for one in outcome.ended),
        "runs": [
            {"scale": one.scale, "test": one.name, "trial": one.record.key, "status": one.record.status,
             "reason": one.record.reason, "seconds": one.record.seconds,
             "cpu_s": one.record.cost["cpu_s"] if one.record.cost else None, "results": one.record.results}
            for one in outcome.ended
        ],
        "version": knittest.__version__, "code": code_digest(), "written": timestamp(),
    }  # fmt: skip


def report_lines(outcome: Outcome) -> list[str]:
    """Lines that the command prints at its end."""
    lost = [one for one in outcome.ended if one.record.status != "completed"]
    lines = [f"  {one.name}, {SCALES[one.scale]}, {one.record.status}: {one.record.reason}" for one in lost]
    lines += relaxed_limits_note(one.record for one in outcome.ended)
    if outcome.failure:
        return [f"no card: {outcome.failure}", *lines]
    width = max(len(f"{row.test}, {row.quantity}") for row in outcome.rows)
    lines.append(f"{'':{width}}  {'meso':>10}  {'macro':>10}  deviation")
    for row in outcome.rows:
        name, mark = f"{row.test}, {row.quantity}", "" if row.is_within_tolerance else f"  above {TOLERANCE:g} %"
        numbers = f"{row.yarns:>10.5g}  {row.shells:>10.5g}  {row.deviation:>+7.2f} %"
        lines.append(f"{name:{width}}  {numbers}  {row.unit}{mark}")
    lines += [outcome.note] if outcome.note else []
    if worst := outcome.worst:
        where = f"{worst.deviation:+.2f} %, {worst.test}, {worst.quantity}"
        lines.append(f"{outcome.status} within {TOLERANCE:g} %: largest deviation {where}")
    return lines


Pairs = dict[PlannedTest, tuple[FinishedTest, FinishedTest]]


def homogenise_picture(outcome: Outcome, pairs: Pairs, path: Path) -> None:
    """Draw tension, shear and bending of ``pairs``, meso and macro run of each test; raises :class:`ResourceError`."""
    figure = new_figure(11.0, 7.2)
    panels = figure.subplots(2, 2).ravel()
    figure.subplots_adjust(left=0.08, right=0.97, bottom=0.08, top=0.86, wspace=0.22, hspace=0.42)
    curves = [piece for piece in pairs if piece.kind != "cantilever"]
    for axes, piece in zip(panels, curves[:2] + curves[-1:], strict=False):
        _draw_curves(dress_panel(axes), piece, *pairs[piece])
    _draw_bending(dress_panel(panels[3]), {piece: pair for piece, pair in pairs.items() if piece.kind == "cantilever"})
    run, worst = outcome.run, outcome.worst
    largest = f"; largest deviation {worst.deviation:+.1f} %" if worst else ""
    numbers = parameter_set_text(run.parameters)
    title = f"{run.fabric.name} ({numbers}), {run.model.preset}: macro model with the card, and meso model{largest}"
    figure.suptitle(title, x=0.08, y=0.975, ha="left", va="top", fontsize=12)
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, frameon=False, fontsize=9.5, loc="upper left", bbox_to_anchor=(0.07, 0.945), ncols=2)
    tested = [f"{piece.name}: {', '.join(size_of(yarns.run))}" for piece, (yarns, _) in pairs.items()]
    facts = (run.fabric.name, f"parameters {numbers}", f"preset {run.model.preset}", *tested)
    with use_stamp(
        Stamp(facts, f"meso model {outcome.status} by the macro model", bad=not outcome.is_within_tolerance)
    ):
        save(figure, path)


def _draw_curves(axes: "Axes", piece: PlannedTest, yarns: FinishedTest, shells: FinishedTest) -> None:
    tensile, biaxial = piece.kind == "tensile", piece.angle is not None
    styles = (("meso model", BLUE, "-", 2.4), ("macro model with the card", ORANGE, "--", 1.6))
    for test, (label, colour, dash, thick) in zip((yarns, shells), styles, strict=True):
        if biaxial:
            strain, *forces = cards.biaxial_forces(test)
            for k, force in enumerate(forces):
                axes.plot(strain, force, dash, color=colour, linewidth=thick, label=None if k else label)
            continue
        curve = cards.tension_to_peak(test) if tensile else cards.normalised_shear_force(test)
        axes.plot(*curve, dash, color=colour, linewidth=thick, label=label)
    axes.set_xlim(left=0.0)
    axes.set_ylim(bottom=0.0)
    if biaxial:
        axes.set(xlabel="larger strain [%]", ylabel="force per width [N/mm]")
        axes.set_title(f"both strains, at {piece.angle:g} deg: forces of warp and weft", loc="left", fontsize=10.5)
    elif tensile:
        axes.set(xlabel="strain [%]", ylabel="force per width [N/mm]")
        axes.set_title(f"tension, {piece.direction}, up to the largest force", loc="left", fontsize=10.5)
    else:
        axes.set_xticks([0.0, *ANGLES])
        axes.set(xlabel="shear angle [deg]", ylabel="normalised force [N/mm]")
        axes.set_title("shear", loc="left", fontsize=10.5)


def _draw_bending(axes: "Axes", pairs: Pairs) -> None:
    axes.grid(False, axis="x")
    for k, (yarns, shells) in enumerate(pairs.values()):
        for test, shift, colour in ((yarns, -0.17, BLUE), (shells, 0.17, ORANGE)):
            stiffness = cards.bending_stiffness(test)
            axes.bar(k + shift, stiffness, 0.3, color=colour)
            axes.annotate(f"{stiffness:.2f}", (k + shift, stiffness), (0, 3), textcoords="offset points", ha="center")
    axes.set_xticks(range(len(pairs)), [str(piece.direction) for piece in pairs])
    axes.margins(y=0.15)
    axes.set_ylabel("bending stiffness [N mm]")
    axes.set_title("bending", loc="left", fontsize=10.5)


RESULT, PICTURE, REQUEST = "homogenise.json", "homogenise.png", "command.txt"


@dataclass(frozen=True, kw_only=True)
class HomogeniseOptions(StudyOptions):
    """Options of a homogenisation; ``time_limit`` [s] is that of a test."""

    time_limit: float = 7200.0
    json: bool = False


def run_homogenisation(request: Request, options: HomogeniseOptions, command: str) -> StudyResult:
    """Homogenise or resume; the exit code is 3 without a card, 5 if the macro model does not reproduce the meso model.

    ``command`` is how it was called. Raises :class:`InputError` before anything runs.
    """
    cell = request.source == "cell"
    runs = {piece: (cell_run if cell else meso_run)(request, piece) for piece in planned_tests(request)}
    first = next(iter(runs.values()))
    name = f"{slug(first.fabric.name)}-{slug(first.parameters)}-{first.model.preset}"
    name = f"homogenise{'-cell' if cell else ''}{'-coupled' if is_coupled(request) else ''}-{name}"
    folder = study_folder(options.out or Path("runs") / name, REQUEST, f"{command}\n", "homogenisation")
    outcome = Outcome(first, command)
    with handle_signals():
        for name in (FABRIC, RESULT, PICTURE):  # of an earlier card
            (folder / name).unlink(missing_ok=True)
        pairs = _work(runs, folder, options, outcome)
        if pairs:
            homogenise_picture(outcome, pairs, folder / PICTURE)
        write_atomic(folder / RESULT, json_text(as_data(outcome)))
    if options.json:
        print(json_text(as_data(outcome)), end="")
    elif not options.quiet:
        files = [RESULT] if outcome.failure else [FABRIC, RESULT, PICTURE]
        for line in [*report_lines(outcome), f"written: {', '.join(str(folder / name) for name in files)}"]:
            print(line)
    error = NumericalError if outcome.failure else OutOfTolerance
    return StudyResult(folder, 0 if outcome.is_within_tolerance else error.exit_code)


def _work(runs: dict[PlannedTest, Run], folder: Path, options: HomogeniseOptions, outcome: Outcome) -> Pairs:
    """Run both scales and fill ``outcome``; the finished tests of both, by piece, empty if there is no card."""
    cell = isinstance(outcome.run, CellRun)
    try:
        yarns = _run_tests(runs, "cell" if cell else "yarns", folder, options, outcome)
        outcome.card = made = cards.card_of(yarns)
        card, last = cards.write_card(made, folder, outcome.command), float(made.shear[0][-1])
        macro = {
            p: _cell_macro_run(p, yarns[p], card, last, made) if cell else macro_run(p, run, card, last)
            for p, run in runs.items()
            if p.angle is None or p.angle in REPEATED
        }
        shells = _run_tests(macro, "shells", folder, options, outcome)
    except (NumericalError, InputError) as error:
        (folder / FABRIC).unlink(missing_ok=True)
        outcome.card, outcome.failure = None, str(error)
        return {}
    pairs = {piece: (yarns[piece], shells[piece]) for piece in macro}
    outcome.rows = [row for piece, pair in pairs.items() for row in compare_scales(piece, *pair)]
    return pairs


def _cell_macro_run(piece: PlannedTest, yarns: FinishedTest, card: Path, last_angle: float, made: MacroCard) -> Run:
    reached = 1.0 if piece.angle is None else cards.reached_share(yarns)
    return cell_macro_run(piece, yarns.run, card, last_angle, made.bending, reached)


def _run_tests(
    runs: dict[PlannedTest, Run], scale: str, folder: Path, options: HomogeniseOptions, outcome: Outcome
) -> dict[PlannedTest, FinishedTest]:
    """Finished tests of one scale, run or from the ledger; raises :class:`NumericalError` if one has no result."""
    trials = {piece: trial_of(run, f"{piece.name}, {SCALES[scale]}") for piece, run in runs.items()}
    pieces = {trial.key: piece for piece, trial in trials.items()}

    def note(record: Record) -> None:
        outcome.ended.append(TestOutcome(scale, pieces[record.key].name, record))
        if record.status == "blocked":
            raise ResourceError(f"{record.reason}; {RESUME_HINT}")

    pool = LocalPool(options.workers, options.threads)
    limit, quiet = options.time_limit, options.quiet
    records = run_with_overview(list(trials.values()), folder, pool, limit=limit, quiet=quiet, check=note)
    ended = [(piece, records[trial.key]) for piece, trial in trials.items()]
    if lost := [f"{piece.name} {r.status}: {r.reason}" for piece, r in ended if r.status != "completed"]:
        raise NumericalError(f"{SCALES[scale]}: {'; '.join(lost)}")
    return {piece: FinishedTest(runs[piece], folder / TRIALS / r.key, r.results, r.key) for piece, r in ended}
