"""Results of a study of uncertainty: its page, results.csv, and the text on the terminal."""

import io
from collections.abc import Mapping, Sequence
from pathlib import Path

from knittest.base.files import write_atomic
from knittest.report_page.blocks import Block, Cell, Code, Page, Section, Table, Text
from knittest.report_page.files import Number, Reader
from knittest.report_page.page import target_file, write_page
from knittest.report_page.pictures import picture
from knittest.report_page.studies import Column, file_to_save, link, problems, provenance, wide
from knittest.studies.trials.runner import TRIALS
from knittest.studies.trials.trial import OPEN, Record
from knittest.studies.uncertainty.outcome import Index, Lost, ParameterRow, StatementRow, Uncertainty, VariableRow
from knittest.studies.uncertainty.problem import Problem, matrix_name
from knittest.studies.uncertainty.runs import Planned, points
from knittest.studies.uncertainty.variables import Numbers

TABLE = "results.csv"


def write_table(
    problem: Problem, runs: Sequence[Planned], records: Mapping[str, Record], numbers: Numbers, folder: Path
) -> None:
    """Point, its place in the design, values of the parameters, every variable; of each run to the full end status and
    reason, and of the one that counts, which may end sooner, the end and the folder.

    Raises :class:`ResourceError`.
    """
    import pandas as pd

    names = [one.name for one in problem.parameters]
    columns = {variable.name: variable.values(numbers) for variable in problem.variables}
    lines = []
    for number, fabrics in enumerate(points(runs), 1):
        first = fabrics[0]
        line: dict[str, object] = {"point": number, "part": matrix_name(first.part, names), "row": first.row + 1}
        line |= dict(zip(names, first.values, strict=True))
        line |= {name: float(values[first.part, first.row]) for name, values in columns.items()}
        lines.append(line | {name: value for one in fabrics for name, value in _ended(problem, one, records).items()})
    text = io.StringIO()
    pd.DataFrame(lines).to_csv(text, index=False, float_format="%.10g")
    write_atomic(folder / TABLE, text.getvalue())


def _ended(problem: Problem, one: Planned, records: Mapping[str, Record]) -> dict[str, object]:
    """Columns on the run ``one``; the folder is that of the full one where none counts."""
    status, reason = one.full.ended(records)
    found: dict[str, object] = {f"{one.fabric} status": status, f"{one.fabric} reason": reason}
    counts = one.last.ended(records)[0] == "completed"
    if problem.shorter.values:
        end = "full" if one.last.end is None else f"{one.last.end:g}"
        found[f"{one.fabric} counts to"] = end if counts else ""
    trial = one.last.trial if counts else one.full.trial
    return found | {f"{one.fabric} folder": f"{TRIALS}/{trial.key}" if trial else ""}


#: parameters named of a variable on the terminal
NAMED = 3


def report_lines(found: Uncertainty) -> list[str]:
    """Lines that the command prints at its end."""
    states = ", ".join(f"{count} {status}" for status, count in found.runs_by_status.items())
    lines = [f"{found.status}: {found.runs} runs ({states}) at {found.points} points"]
    lines += [f"  lost ones again, {told}" for told in shorter_texts(found)]
    lines.append("5, 50, 95 %:")
    for one in found.variables:
        band = band_text(one) if one.band else f"none: {one.count} of {one.points} points have a number"
        lines.append(f"  {one.name}: {band}")
        lines.append(f"    {_hangs_on(one)}" if one.indices else f"    no indices: {one.no_indices}")
    lines += [f"{one.name} ({one.text}): {share_text(one)}" for one in found.statements]
    return [*lines, *(f"warning: {text}" for text in found.warnings)]


def shorter_texts(found: Uncertainty) -> list[str]:
    """``to 21 deg: 40 (30 completed, 10 refused)`` for each shorter end that runs were tried again to."""
    unit = f" {found.shorter_unit}" if found.shorter_unit not in ("", "1") else ""
    return [
        f"to {one.end:g}{unit}: {sum(one.runs_by_status.values())} "
        f"({', '.join(f'{count} {status}' for status, count in one.runs_by_status.items())})"
        for one in found.shorter
        if one.runs_by_status
    ]


def ranked(one: VariableRow) -> list[Index]:
    """Indices of a variable, the largest of first order first: what is to be measured first."""
    return sorted(one.indices, key=lambda index: -abs(index.first or 0.0))


def _hangs_on(one: VariableRow) -> str:
    first = [f"{short(i.parameter)} {index_text(i.first, i.first_interval)}" for i in ranked(one)[:NAMED]]
    name = "first order" if one.explained is None else f"rank regression (R2 {one.explained:.2f})"
    return f"{name}: {'; '.join(first)}"


def short(parameter: str) -> str:
    """Last two parts of a dotted path."""
    return ".".join(parameter.split(".")[-2:])


def band_text(one: VariableRow) -> str:
    """``0.35 to 1.2, median 0.7 N``, and how many points of the prior it is of where some have no number."""
    low, middle, high = ("-" if value is None else f"{value:.4g}" for value in one.band)
    unit = f" {one.unit}" if one.unit not in ("", "1") else ""
    some = f" ({points_text(one)} points)" if one.count < one.points or one.shortened else ""
    return f"{low} to {high}, median {middle}{unit}{some}"


def points_text(one: VariableRow) -> str:
    """``93 of 128``, and how many of these are of runs that ended sooner."""
    return f"{one.count} of {one.points}" + (f", {one.shortened} shortened" if one.shortened else "")


def index_text(value: Number, interval: Sequence[Number]) -> str:
    """An index with its interval."""
    ends = [end for end in interval if end is not None]
    return "-" if value is None else f"{value:.2f}" + (f" ({ends[0]:.2f} to {ends[1]:.2f})" if len(ends) == 2 else "")


def share_text(one: StatementRow) -> str:
    """Share of the prior, its interval, and between which shares it lies whatever the lost runs would have given."""
    if one.share is None:
        return f"no share: none of {one.points} points has a number"
    ends = [100.0 * end for end in one.interval if end is not None]
    text = f"{100.0 * one.share:.0f} % of the prior"
    text += f" (95 % interval {ends[0]:.0f} to {ends[1]:.0f} %)" if len(ends) == 2 else ""
    if one.count < one.points:
        least, most = (100.0 * (end or 0.0) for end in one.possible)
        lost = one.points - one.count
        text += f", of {one.count} of {one.points} points; {least:.0f} to {most:.0f} %, whatever the other {lost} give"
        text += f", {one.failing} of which fail where they have numbers" if one.failing else ""
    return text


RESULT, COPY = "uncertainty.json", "uncertainty.yaml"
#: what the indices say
MEANING = (
    "First order: the share of the variance that would go if this parameter alone were known; the largest is to be "
    "measured first. Total: the share that would be left if all others were known; near 0, it need not be measured."
)
RANKS = (
    "Standardised coefficients of a regression of ranks, -1 to 1: the square is the share of the variance of the ranks "
    "that goes with the parameter, the sign whether the quantity rises or falls with it; R2 is what all explain."
)
NOISE = "(log): of the logarithm. Noise of single runs counts as interaction: in all total indices."
#: rows of the table of runs without a result
MOST_LOST = 100


def is_uncertainty(folder: Path) -> bool:
    """Tell whether ``folder`` is that of a study of uncertainty with a result."""
    return (folder / RESULT).is_file()


def write_uncertainty_page(folder: Path, out: Path | None = None) -> Path:
    """Write the page of the study in ``folder`` into it, or to ``out``; raises as ``write_reports`` does."""
    target = target_file([folder], out)
    return write_page(target, uncertainty_page(folder, target.parent))


def uncertainty_page(folder: Path, at: Path) -> Page:
    """The page of the study in ``folder``, to lie in the folder ``at``.

    What is missing or damaged is named on it and costs its own part only.
    """
    reader = Reader(folder)
    found = reader.model(RESULT, Uncertainty)
    parts = [
        Section("statements", "Statements", _statements(found), 2),
        Section("bands", "Bands", [*_picture(folder, "bands.png", "Medians, and 5 to 95 %"), *_bands(found)], 2),
        Section("indices", "Hanging on", [*_picture(folder, "indices.png", "Indices"), *_indices(found)], 2),
        Section("parameters", "Priors", _parameters(found), 2),
        Section("fabrics", "Fabrics", _fabrics(found), 2),
        Section("lost", "Without a result", _lost(folder, at, found), 2),
        Section("repeat", "How to repeat it", _repeat(reader), 2),
    ]
    head = Section("summary", "Uncertainty", [*_ending(found), *problems(reader), _facts(found)], 2)
    return Page(f"Uncertainty {found.uncertainty or folder.resolve().name}", found.status, [head, *parts])


def _picture(folder: Path, name: str, caption: str) -> list[Block]:
    if not (folder / name).is_file():
        return [Text(f"There is no picture {name}: there was nothing to draw.")]
    return [picture(folder / name, caption)]


def _ending(found: Uncertainty) -> list[Block]:
    left = sum(states.get(OPEN, 0) for states in (found.runs_by_status, *(one.runs_by_status for one in found.shorter)))
    told = f"Not finished; runs left: {left}. The same command goes on with them."
    blocks: list[Block] = [Text(told, "warn")] if left else []
    return [*blocks, *(Text(f"Warning: {text}.", "warn") for text in found.warnings)]


def _facts(found: Uncertainty) -> Block:
    states = ", ".join(f"{count} {status}" for status, count in found.runs_by_status.items())
    share = found.lost_share
    facts = {
        "test": ", ".join(filter(None, (found.test, *found.setup))),
        "design": f"{found.design}, {found.samples} samples of A and B, {found.points} points, seed {found.seed}",
        "runs": f"{found.runs}" + (f" ({states})" if states else ""),
        "lost on their way, again": "; ".join(shorter_texts(found)),
        "without all numbers": "" if share is None else f"{100.0 * share:.1f} %",
        "knittest": found.version,
        "digest of the code": found.code,
        "written": found.written,
    }
    return Table("The study", (), [(Cell(name), Cell(value)) for name, value in facts.items() if value])


def _statements(found: Uncertainty) -> list[Block]:
    rows = [(Cell(one.name), Cell(one.text), Cell(share_text(one), one.share)) for one in found.statements]
    if not rows:
        return [Text("The file states none.")]
    return [Table("Share of the prior for which each holds, at all places at once", ("", "statement", "share"), rows)]


def _bands(found: Uncertainty) -> list[Block]:
    rows = [
        (
            Cell(one.name),
            *(_percentile(one, k) for k in range(3)),
            Cell(points_text(one), tone="warn" if one.count < one.points else ""),
        )
        for one in found.variables
    ]
    header = ("quantity", "5 %", "50 %", "95 %", "points")
    told = (
        "Small print: 95 % interval of the percentile, for the number of points. Errors of the model that no parameter "
        "stands for are not in a band. Shortened: of runs to a shorter end, which passed every gate up to there."
    )
    return [Table("Percentiles over the prior", header, rows, (1, 2, 3)), Text(told)]


def _percentile(one: VariableRow, k: int) -> Cell:
    if k >= len(one.band) or one.band[k] is None:
        return Cell("-")
    value = one.band[k]
    unit = f" {one.unit}" if one.unit not in ("", "1") else ""
    ends = [side[k] for side in (one.band_low, one.band_high) if k < len(side)]
    note = f"{_number(ends[0])} to {_number(ends[1])}" if len(ends) == 2 else ""
    return Cell(f"{_number(value)}{unit}", value, note=note)


def _indices(found: Uncertainty) -> list[Block]:
    """Indices of every variable that has some, and the reasons of the others."""
    some = [one for one in found.variables if one.indices]
    blocks: list[Block] = []
    if some:
        names = [index.parameter for index in some[0].indices]
        naming = [Column("parameter", [Cell(short(name), note=name) for name in names])]
        columns = [Column(one.name + _after(one), _cells(one), numeric=True) for one in some]
        ranks = some[0].explained is not None
        blocks += wide(
            "Regression of ranks" if ranks else "First-order indices; small print: total ones", naming, columns
        )
        blocks += [Text(RANKS)] if ranks else [Text(MEANING), Text(NOISE)]
    for one in found.variables:
        if one.no_indices:
            blocks.append(Text(f"No indices of {one.name}: {one.no_indices}.", "warn"))
    return blocks or [Text("There are no variables.")]


def _after(one: VariableRow) -> str:
    if one.explained is not None:
        return f" (R2 {one.explained:.2f})"
    return " (log)" if one.log else ""


def _cells(one: VariableRow) -> list[Cell]:
    notes = ["" if i.total is None else f"total {index_text(i.total, i.total_interval)}" for i in one.indices]
    return [
        Cell(index_text(i.first, i.first_interval), i.first, note=note)
        for i, note in zip(one.indices, notes, strict=True)
    ]


def _parameters(found: Uncertainty) -> list[Block]:
    rows = [
        (Cell(", ".join(one.fields)), Cell(_prior(one)), Cell(one.unit if one.unit != "1" else "-"), Cell(one.reason))
        for one in found.parameters
    ]
    header = ("parameter", "prior", "unit", "reason")
    told = "All fabrics take the same value. The parameters are drawn independently of each other."
    return [Table("What was assumed of each parameter", header, rows), Text(told)]


def _prior(one: ParameterRow) -> str:
    middle = f" {_number(one.mean)} ± {_number(one.sd)}," if one.mean is not None else ""
    return f"{one.kind}{middle} {_number(one.low)} to {_number(one.high)}"


def _fabrics(found: Uncertainty) -> list[Block]:
    blocks: list[Block] = [Table("Fabrics", (), [(Cell(name), Cell(of)) for name, of in found.fabrics.items()])]
    rows = [(Cell(name), *(Cell(str(value)) for value in values)) for name, values in found.differences.items()]
    width = len(found.fabrics)
    whole = [row for row in rows if len(row) == width + 1]
    if whole:
        return [*blocks, Table("Fields in which they differ; all others are equal", ("", *found.fabrics), whole)]
    return [*blocks, Text("They differ in nothing that the test reads." if width > 1 else "There is one fabric.")]


def _lost(folder: Path, at: Path, found: Uncertainty) -> list[Block]:
    if not found.lost:
        return [Text("Every run gave a result that counts.")]
    shown = found.lost[:MOST_LOST]
    naming = [
        Column("point", [Cell(str(o.point), href=link(folder, f"{TRIALS}/{o.trial}", at)) for o in shown]),
        Column("fabric", [Cell(one.fabric) for one in shown]),
        Column("state", [Cell(one.status, note=one.reason, tone="bad") for one in shown]),
    ]
    if found.shorter:
        unit = f" [{found.shorter_unit}]" if found.shorter_unit else ""
        naming.append(Column(f"counts to{unit}", [_counting(folder, at, one) for one in shown]))
    names: Sequence[str] = list(dict.fromkeys(name for one in shown for name in one.values))
    columns = [Column(short(n), [_value(one.values.get(n)) for one in shown], numeric=True) for n in names]
    more = f", the first {MOST_LOST}; results.csv has all" if len(found.lost) > MOST_LOST else ""
    return wide(f"Runs that did not give every number: {len(found.lost)}{more}", naming, columns)


def _counting(folder: Path, at: Path, one: Lost) -> Cell:
    """Shorter end of the run that counts, with a link to it, and why those before it do not."""
    told = "; ".join(f"{again.end:g}: {again.reason.partition(';')[0]}" for again in one.tried if again.reason)
    if one.counts_to is None:
        return Cell("-", note=told)
    return Cell(
        f"{one.counts_to:g}", one.counts_to, note=told, href=link(folder, f"{TRIALS}/{one.tried[-1].trial}", at)
    )


def _repeat(reader: Reader) -> list[Block]:
    blocks: list[Block] = [Code(f"knittest uncertainty {COPY}", f"Command; {COPY} is the one below")]
    blocks += file_to_save(reader, COPY, "The study; its files are seen from its own folder")
    folders = sorted((reader.folder / TRIALS).glob("*/manifest.json"))
    return [*blocks, *provenance(reader.folder, [f"{TRIALS}/{path.parent.name}" for path in folders])]


def _value(value: Number) -> Cell:
    return Cell(_number(value), value)


def _number(value: Number) -> str:
    return "-" if value is None else f"{value:.4g}"
