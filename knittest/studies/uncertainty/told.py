"""Bands, shares and indices as text, on the terminal and on the page."""

from collections.abc import Sequence

from knittest.report_page.files import Number
from knittest.studies.uncertainty.written import Index, StatementRow, Uncertainty, VariableRow

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
