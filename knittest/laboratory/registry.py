"""Tests and their reports by the name of the rig, of all installed packages."""

from collections.abc import Mapping
from typing import Any

from knittest.base.errors import InputError
from knittest.base.kinds import Parts, TestKind
from knittest.laboratory.base import Test
from knittest.laboratory.report_base import Report


def _made(kind: TestKind, part: str, protocol: type) -> Any:
    """Instance of ``part`` of ``kind``; raises :class:`InputError` where a part of its ``protocol`` is missing."""
    maker, made = kind.load(part), None
    missing = {*getattr(maker, "__abstractmethods__", ())}  # of one that inherits the protocol, which cannot be made
    if not missing:
        made = maker()
        wanted = {*getattr(protocol, "__abstractmethods__", ()), *protocol.__annotations__}
        missing = {name for name in wanted if not hasattr(made, name)}
    if missing:
        lacking = ", ".join(sorted(missing))
        raise InputError(f"test {kind.name}: {getattr(kind, part)} lacks {lacking}: see {protocol.__name__}")
    return made


# each takes runs of its own kind, which only their name tells
TESTS: Mapping[str, Test[Any]] = Parts(lambda kind: _made(kind, "test", Test))
REPORTS: Mapping[str, Report[Any]] = Parts(lambda kind: _made(kind, "report", Report))
