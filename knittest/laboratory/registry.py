"""Tests and their reports by the name of the rig, of all installed packages."""

from collections.abc import Mapping, Sequence
from inspect import isfunction
from types import MethodType
from typing import Any

from knittest.base.errors import InputError
from knittest.base.kinds import Parts, TestKind
from knittest.base.notes import tell
from knittest.config.run import Run
from knittest.laboratory.base import Test
from knittest.laboratory.report_base import Report


def _made(kind: TestKind, part: str, protocol: type) -> Any:
    """Instance of ``part`` of ``kind``, with what its ``protocol`` does by default where the instance does not say.

    Raises :class:`InputError` where a part of the protocol without a default is missing.
    """
    maker, made = kind.load(part), None
    missing = {*getattr(maker, "__abstractmethods__", ())}  # of one that inherits the protocol, which cannot be made
    if not missing:
        made = maker()
        stated = protocol.__annotations__.keys() - vars(protocol).keys()
        wanted = {*getattr(protocol, "__abstractmethods__", ()), *stated}
        missing = {name for name in wanted if not hasattr(made, name)}
    if missing:
        lacking = ", ".join(sorted(missing))
        raise InputError(f"test {kind.name}: {getattr(kind, part)} lacks {lacking}: see {protocol.__name__}")
    for name, default in vars(protocol).items():  # of one that does not inherit the protocol
        if name.startswith("_") or hasattr(made, name):
            continue
        if isfunction(default):
            setattr(made, name, MethodType(default, made))
        elif name in protocol.__annotations__:
            setattr(made, name, default)
    return made


# each takes runs of its own kind, which only their name tells
TESTS: Mapping[str, Test[Any]] = Parts(lambda kind: _made(kind, "test", Test))
REPORTS: Mapping[str, Report[Any]] = Parts(lambda kind: _made(kind, "report", Report))


def completed(runs: Sequence[Run], quiet: bool = False) -> list[Run]:
    """``runs`` with an estimate of what they leave open, which is told unless ``quiet``."""
    found = [TESTS[run.rig.kind].completed(run) for run in runs]
    for _, said in found:
        if said and not quiet:
            tell(said)
    return [run for run, _ in found]
