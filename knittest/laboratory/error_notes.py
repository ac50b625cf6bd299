"""Notes below results on their numerical error: how it was found, what it cost, or why there is none."""

from collections.abc import Mapping

from knittest.base.summary import RepeatBlock, Summary
from knittest.laboratory.numerical_error import NO_NUMBER

#: what a run that was not repeated says
NOT_ESTIMATED = "numerical error: not estimated (--verify)"
#: what a run says whose repeats were asked for and did not end
UNFINISHED = "numerical error: its repeats are not finished; knittest resume goes on"


def error_notes(summary: Summary, *, asked: bool = False) -> list[str]:
    """Lines on the numerical errors of ``summary`` (summary.json): one a repeat, then what else to know.

    Of a refused run none. ``asked``: the run was to be repeated.
    """
    if summary.get("refused"):
        return []
    told = summary.get("verification")
    if not told:
        return [UNFINISHED if asked else NOT_ESTIMATED]
    repeats = (("half", told.get("half_speed")), ("other mesh", told.get("mesh")))
    lines = [_line(what, repeat) for what, repeat in repeats if isinstance(repeat, Mapping)]
    if any(isinstance(value, Mapping) and "values" in value for value in summary["results"].values()):
        lines.append("numerical error: that of the first specimen")
    missing = {row.get("reason") for row in (summary.get("numerical_error") or {}).values() if row.get("error") is None}
    missing -= {NO_NUMBER}
    if missing:
        lines.append("numerical error: not available: " + "; ".join(sorted(str(reason) for reason in missing)))
    return lines


def _line(what: str, repeat: RepeatBlock) -> str:
    """Line on what was changed, and what the repeat cost."""
    if not repeat.get("setting"):
        return f"numerical error, {what}: none: {repeat.get('reason')}"
    text = f"numerical error, {what}: {repeat['setting']} {repeat['value']} -> {repeat['other_value']}"
    wall, cpu = repeat.get("wall_s"), repeat.get("cpu_s")
    cost = f", {wall:.3g} s, {cpu:.3g} s of processor" if wall is not None and cpu is not None else ""
    instead = f", in place of {repeat['instead_of']}" if repeat.get("instead_of") else ""
    return f"{text}: {repeat.get('status')}{cost}{instead}"
