"""Results of a study of uncertainty: its page, results.csv, and the text on the terminal."""

from collections.abc import Mapping, Sequence
from itertools import groupby
from pathlib import Path

from knittest.report_page.blocks import Block, Cell, Table, Text
from knittest.report_page.files import Number, Reader
from knittest.report_page.pictures import picture
from knittest.report_page.studies import Column, link, provenance, split_table
from knittest.studies.trials import page as parts
from knittest.studies.trials.runner import TRIALS
from knittest.studies.trials.trial import OPEN, Record
from knittest.studies.uncertainty.outcome import Index, LostRunRow, StatementRow, Uncertainty, VariableRow
from knittest.studies.uncertainty.problem import Problem, matrix_name
from knittest.studies.uncertainty.runs import PlannedRun
from knittest.studies.uncertainty.variables import Numbers


def write_table(
    problem: Problem, runs: Sequence[PlannedRun], records: Mapping[str, Record], numbers: Numbers, folder: Path
) -> None:
    """Write results.csv: points of the design with parameters, variables and runs; raises :class:`ResourceError`."""
    import pandas as pd

    names = [one.name for one in problem.parameters]
    columns = {variable.name: variable.values(numbers) for variable in problem.variables}
    lines = []
    for number, (_, fabrics) in enumerate(groupby(runs, lambda one: (one.part, one.row)), 1):
        first, *others = fabrics
        line: dict[str, object] = {"point": number, "part": matrix_name(first.part, names), "row": first.row + 1}
        line |= dict(zip(names, first.values, strict=True))
        line |= {name: float(values[first.part, first.row]) for name, values in columns.items()}
        for one in (first, *others):
            status, reason = one.full.ended(records)
            counts = one.last.ended(records)[0] == "completed"
            line |= {f"{one.fabric} status": status, f"{one.fabric} reason": reason}
            if problem.shorter.values:
                end = "full" if one.last.end is None else f"{one.last.end:g}"
                line[f"{one.fabric} counts to"] = end if counts else ""
            key = (one.last if counts else one.full).key
            line[f"{one.fabric} folder"] = f"{TRIALS}/{key}" if key else ""
        lines.append(line)
    parts.write_csv(pd.DataFrame(lines), folder)


#: parameters of a variable on the terminal
MOST_NAMED = 3


def report_lines(found: Uncertainty) -> list[str]:
    """Lines that the command prints at its end."""
    lines = [f"{found.status}: {found.runs} runs ({parts.counts_text(found.runs_by_status)}) at {found.points} points"]
    lines += [f"  failed runs repeated {text}" for text in shorter_end_texts(found)]
    lines.append("bands, 5 to 95 %:")
    for one in found.variables:
        band = f"none: {one.count} of {one.points} points have a result"
        if one.band:  # of all points, or of some
            low, middle, high = ("-" if value is None else f"{value:.4g}" for value in one.band)
            some = f" ({points_text(one)} points)" if one.count < one.points or one.shortened else ""
            band = f"{low} to {high}, median {middle}{parts.unit_text(one.unit)}{some}"
        lines.append(f"  {one.name}: {band}")
        if not one.indices:
            lines.append(f"    no indices: {one.no_indices}")
            continue
        first = [
            f"{short_name(i.parameter)} {index_text(i.first, i.first_interval)}"
            for i in ranked_indices(one)[:MOST_NAMED]
        ]
        name = "first order" if one.explained is None else f"rank regression (R2 {one.explained:.2f})"
        lines.append(f"    {name}: {'; '.join(first)}")
    lines += [f"{one.name} ({one.text}): {share_text(one)}" for one in found.statements]
    return [*lines, *(f"warning: {text}" for text in found.warnings)]


def shorter_end_texts(found: Uncertainty) -> list[str]:
    """``to 21 deg: 40 (30 completed, 10 refused)`` for each shorter end of repeated runs."""
    unit = parts.unit_text(found.shorter_unit)
    states = {one.end: one.runs_by_status for one in found.shorter if one.runs_by_status}
    return [f"to {end:g}{unit}: {parts.runs_text(sum(counts.values()), counts)}" for end, counts in states.items()]


def ranked_indices(one: VariableRow) -> list[Index]:
    """Indices of a variable, the largest of first order first."""
    return sorted(one.indices, key=lambda index: -abs(index.first or 0.0))


def short_name(parameter: str) -> str:
    """Last two parts of a dotted path."""
    return ".".join(parameter.split(".")[-2:])


def points_text(one: VariableRow) -> str:
    """``93 of 128``, and the number of these from runs to a shorter end."""
    return f"{one.count} of {one.points}" + (f", {one.shortened} shortened" if one.shortened else "")


def index_text(value: Number, interval: Sequence[Number]) -> str:
    """Index with its interval."""
    ends = [end for end in interval if end is not None]
    return "-" if value is None else f"{value:.2f}" + (f" ({ends[0]:.2f} to {ends[1]:.2f})" if len(ends) == 2 else "")


def share_text(one: StatementRow) -> str:
    """Share of the prior, its interval, and its possible range if runs lack a result."""
    if one.share is None:
        return f"no share: none of {one.points} points has a result"
    ends = [100.0 * end for end in one.interval if end is not None]
    text = f"{100.0 * one.share:.0f} % of the prior"
    text += f" (95 % interval {ends[0]:.0f} to {ends[1]:.0f} %)" if len(ends) == 2 else ""
    if one.count < one.points:
        least, most = (100.0 * (end or 0.0) for end in one.possible)
        lost = one.points - one.count
        bounds = f"{least:.0f} to {most:.0f} % for any result of the other {lost}"
        text += f", from {one.count} of {one.points} points; {bounds}"
        text += f", {one.failing} of which fail at a place with a result" if one.failing else ""
    return text


RESULT, COPY = "uncertainty.json", "uncertainty.yaml"
#: meaning of the indices
MEANING = (
    "First order: the share of the variance that vanishes if this parameter alone is known; measure the parameter with "
    "the largest one first. Total: the share that remains if all other parameters are known; a parameter with a value "
    "near 0 need not be measured."
)
RANKS = (
    "Standardised coefficients of a rank regression, -1 to 1. The square is the share of the variance of the ranks by "
    "this parameter; the sign says whether the quantity rises or falls with it. R2 is the share that all explain."
)
NOISE = "(log): of the logarithm. Noise of single runs counts as interaction and raises all total indices."
BANDS = (
    "Small print: 95 % interval of the percentile for this number of points. Bands contain no modelling errors except "
    "those of the parameters. Shortened: from runs to a shorter end, which passed all quality checks up to it."
)
#: most rows of the table of runs without a result
MOST_LOST = 100


def _contents(reader: Reader, at: Path) -> parts.Contents:
    found, folder = reader.model(RESULT, Uncertainty), reader.folder
    left = sum(states.get(OPEN, 0) for states in (found.runs_by_status, *(one.runs_by_status for one in found.shorter)))
    notes: list[Block] = [Text(parts.NOT_FINISHED.format(left), "warn")] if left else []
    facts = {
        "test": ", ".join(filter(None, (found.test, *found.setup))),
        "design": f"{found.design}, {found.samples} samples of A and B, {found.points} points, seed {found.seed}",
        "runs": parts.runs_text(found.runs, found.runs_by_status),
        "runs repeated to a shorter end": "; ".join(shorter_end_texts(found)),
        "runs that lack a result": "" if found.lost_share is None else f"{100.0 * found.lost_share:.1f} %",
        "knittest": found.version,
        "digest of the code": found.code,
        "written": found.written,
    }
    shares = [(Cell(one.name), Cell(one.text), Cell(share_text(one), one.share)) for one in found.statements]
    stated: list[Block] = [Text("The file has no statements.")]
    if shares:
        stated = [Table("Share of the prior for which each holds at all places", ("", "statement", "share"), shares)]
    trials = [f"{TRIALS}/{path.parent.name}" for path in sorted((folder / TRIALS).glob("*/manifest.json"))]
    return parts.Contents(
        found.uncertainty, found.status, [*notes, *parts.warning_texts(found.warnings)],
        [parts.facts_table("The study", facts)],
        [
            ("statements", "Statements", stated),
            ("bands", "Bands", [*_picture(folder, "bands.png", "Medians, and 5 to 95 %"), *_bands(found)]),
            ("indices", "Sensitivity indices", [*_picture(folder, "indices.png", "Indices"), *_indices(found)]),
            ("parameters", "Priors", _parameters(found)),
            ("fabrics", "Fabrics", _fabrics(found)),
            ("lost", "Runs that lack a result", _lost_runs(folder, at, found)),
            ("repeat", "How to repeat it", [
                *parts.repeat_blocks("uncertainty", COPY, "The study; paths in it start at its own folder", reader),
                *provenance(folder, trials),
            ]),
        ],
    )  # fmt: skip


PAGE = parts.StudyPage("Uncertainty", (RESULT,), _contents)


def _picture(folder: Path, name: str, caption: str) -> list[Block]:
    if not (folder / name).is_file():
        return [Text(f"There is no picture {name}: no variable has a value for it.")]
    return [picture(folder / name, caption)]


def _bands(found: Uncertainty) -> list[Block]:
    rows = []
    for one in found.variables:
        points = Cell(points_text(one), tone="warn" if one.count < one.points else "")
        rows.append((Cell(one.name), *(_percentile(one, k) for k in range(3)), points))
    header = ("quantity", "5 %", "50 %", "95 %", "points")
    return [Table("Percentiles over the prior", header, rows, (1, 2, 3)), Text(BANDS)]


def _percentile(one: VariableRow, k: int) -> Cell:
    if k >= len(one.band) or one.band[k] is None:
        return Cell("-")
    ends = [side[k] for side in (one.band_low, one.band_high) if k < len(side)]
    note = f"{_number(ends[0])} to {_number(ends[1])}" if len(ends) == 2 else ""
    return parts.number_cell(one.band[k], one.unit, note, "{:.4g}")


def _indices(found: Uncertainty) -> list[Block]:
    """Indices of every variable, or the reason why it has none."""
    some = [one for one in found.variables if one.indices]
    blocks: list[Block] = []
    if some:
        names = [index.parameter for index in some[0].indices]
        naming = [Column("parameter", [Cell(short_name(name), note=name) for name in names])]
        columns = []
        for one in some:
            r2 = "" if one.explained is None else f" (R2 {one.explained:.2f})"
            notes = ["" if i.total is None else f"total {index_text(i.total, i.total_interval)}" for i in one.indices]
            texts = [(i.first, index_text(i.first, i.first_interval)) for i in one.indices]
            cells = [Cell(text, value, note=note) for (value, text), note in zip(texts, notes, strict=True)]
            columns.append(Column(one.name + (r2 or (" (log)" if one.log else "")), cells, numeric=True))
        ranks = some[0].explained is not None
        caption = "Rank regression" if ranks else "First-order indices; small print: total indices"
        blocks += split_table(caption, naming, columns)
        blocks += [Text(RANKS)] if ranks else [Text(MEANING), Text(NOISE)]
    for one in found.variables:
        if one.no_indices:
            blocks.append(Text(f"No indices of {one.name}: {one.no_indices}.", "warn"))
    return blocks or [Text("There are no variables.")]


def _parameters(found: Uncertainty) -> list[Block]:
    rows = []
    for one in found.parameters:
        middle = f" {_number(one.mean)} ± {_number(one.sd)}," if one.mean is not None else ""
        prior = f"{one.kind}{middle} {_number(one.low)} to {_number(one.high)}"
        unit = one.unit if one.unit != "1" else "-"
        rows.append((Cell(", ".join(one.fields)), Cell(prior), Cell(unit), Cell(one.reason)))
    header = ("parameter", "prior", "unit", "reason")
    note = "All fabrics have the same value. The parameters are drawn independently of each other."
    return [Table("Assumed distribution of each parameter", header, rows), Text(note)]


def _fabrics(found: Uncertainty) -> list[Block]:
    blocks: list[Block] = [parts.facts_table("Fabrics", found.fabrics)]
    rows = [(Cell(name), *(Cell(str(value)) for value in values)) for name, values in found.differences.items()]
    width = len(found.fabrics)
    whole = [row for row in rows if len(row) == width + 1]
    if whole:
        return [*blocks, Table("Fields in which they differ; all others are equal", ("", *found.fabrics), whole)]
    return [*blocks, Text("They have equal fields for this test." if width > 1 else "There is one fabric.")]


def _lost_runs(folder: Path, at: Path, found: Uncertainty) -> list[Block]:
    if not found.lost:
        return [Text("Every run has a valid result.")]
    shown = found.lost[:MOST_LOST]
    naming = [
        Column("point", [Cell(str(o.point), href=link(folder, f"{TRIALS}/{o.trial}", at)) for o in shown]),
        Column("fabric", [Cell(one.fabric) for one in shown]),
        Column("state", [Cell(one.status, note=one.reason, tone="bad") for one in shown]),
    ]
    if found.shorter:
        unit = f" [{found.shorter_unit}]" if found.shorter_unit else ""
        naming.append(Column(f"counts to{unit}", [_shorter_end_cell(folder, at, one) for one in shown]))
    names: Sequence[str] = list(dict.fromkeys(name for one in shown for name in one.values))
    cells = {name: [parts.number_cell(one.values.get(name), form="{:.4g}") for one in shown] for name in names}
    columns = [Column(short_name(name), numbers, numeric=True) for name, numbers in cells.items()]
    more = f", the first {MOST_LOST}; {parts.TABLE} has all" if len(found.lost) > MOST_LOST else ""
    return split_table(f"Runs that lack a result: {len(found.lost)}{more}", naming, columns)


def _shorter_end_cell(folder: Path, at: Path, one: LostRunRow) -> Cell:
    """Shorter end of the run that counts, with a link to it, and the reasons why the runs before it do not."""
    reasons = "; ".join(f"{again.end:g}: {again.reason.partition(';')[0]}" for again in one.tried if again.reason)
    if one.counts_to is None:
        return Cell("-", note=reasons)
    href = link(folder, f"{TRIALS}/{one.tried[-1].trial}", at)
    return Cell(f"{one.counts_to:g}", one.counts_to, note=reasons, href=href)


def _number(value: Number) -> str:
    return "-" if value is None else f"{value:.4g}"
