"""Machine of a run: processor time lost to its host; host name and passwords in files."""

import os
import re
import socket
from pathlib import Path

STAT = Path("/proc/stat")


def processor_ticks(stat: Path = STAT) -> tuple[int, int] | None:
    """Ticks that the host has taken from all processors (steal), and all ticks, of ``/proc/stat``; None if unknown."""
    try:
        # user, nice, system, idle, iowait, irq, softirq, steal (proc(5)); guests are in user
        name, *fields = stat.read_text(encoding="ascii").split("\n", 1)[0].split()
        ticks = [int(field) for field in fields[:8]]
    except (OSError, ValueError):
        return None
    return (ticks[7], sum(ticks)) if name == "cpu" and len(ticks) == 8 else None


def steal_share(before: tuple[int, int] | None, after: tuple[int, int] | None) -> float | None:
    """Share of processor time that the host took between two readings; None if unknown."""
    if before is None or after is None or after[1] <= before[1]:
        return None
    return (after[0] - before[0]) / (after[1] - before[1])


HIDDEN = "***"
HOST_VARIABLE = "KNITTEST_HOST"
# as SQLAlchemy reads them: a user without colon or slash, a password up to the @
_PASSWORD = re.compile(r"(://[^:/\s@]*:)[^@\s]*@")
_IN_QUERY = re.compile(r"([?&][^=&\s]*(?:pass|pwd|secret|token|key)[^=&\s]*=)[^&\s'\"]*", re.IGNORECASE)


def hide_passwords(text: str) -> str:
    """Replace the password of every URL in ``text``, also in its query, by :data:`HIDDEN`."""
    return _IN_QUERY.sub(rf"\g<1>{HIDDEN}", _PASSWORD.sub(rf"\g<1>{HIDDEN}@", text))


def available_cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def host_name() -> str:
    """Name of this machine in files: ``KNITTEST_HOST``, which may be empty, else its own."""
    return os.environ.get(HOST_VARIABLE, socket.gethostname())
