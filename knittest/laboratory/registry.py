"""Tests and their reports by the name of the rig, of all installed packages."""

from collections.abc import Mapping
from typing import Any

from knittest.base.errors import InputError
from knittest.base.kinds import Parts, TestKind
from knittest.laboratory.base import Test
from knittest.laboratory.report_base import Report


def _made(kind: TestKind, part: str, protocol: type) -> Any:
    """Instance of ``part`` of ``kind``; raises :class:`InputError` where a part of its ``protocol`` is missing."""
    made = kind.load(part)()
    wanted = {*getattr(protocol, "__abstractmethods__", ()), *protocol.__annotations__}
    if missing := sorted(name for name in wanted if not hasattr(made, name)):
        raise InputError(f"test {kind.name}: {getattr(kind, part)} lacks {', '.join(missing)}: see {protocol.__name__}")
    return made


# each takes runs of its own kind, which only their name tells
TESTS: Mapping[str, Test[Any]] = Parts(lambda kind: _made(kind, "test", Test))
REPORTS: Mapping[str, Report[Any]] = Parts(lambda kind: _made(kind, "report", Report))
