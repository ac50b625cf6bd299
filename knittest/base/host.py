"""Time of its processors that a virtual machine loses to its host."""

from pathlib import Path

STAT = Path("/proc/stat")


def processor_ticks(stat: Path = STAT) -> tuple[int, int] | None:
    """Ticks that a host has taken from all processors since the start, and all ticks; None where no system tells.

    Fields of ``/proc/stat`` (proc(5)): user, nice, system, idle, iowait, irq, softirq, steal; guests are in user.
    """
    try:
        name, *fields = stat.read_text().split("\n", 1)[0].split()
        ticks = [int(field) for field in fields[:8]]
    except (OSError, ValueError):
        return None
    return (ticks[7], sum(ticks)) if name == "cpu" and len(ticks) == 8 else None


def taken_share(before: tuple[int, int] | None, after: tuple[int, int] | None) -> float | None:
    """Share of the processors' time that the host took between two looks; None where it is not known."""
    if before is None or after is None or after[1] <= before[1]:
        return None
    return (after[0] - before[0]) / (after[1] - before[1])
