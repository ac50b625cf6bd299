"""Origins of the rows of tests: what their runs were given, as the folder of each test says."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Generic, Literal, TypeVar

from knittest.base.kinds import Parts
from knittest.config.deciding import deciding, entry
from knittest.config.fabric import Fabric
from knittest.config.run import Run
from knittest.experiment.borrowed import borrowed

RowKind = Literal["predicted", "tuned", "input", "assumed"]
RunT = TypeVar("RunT", bound=Run)


class Origin(Generic[RunT]):
    """Origin of the rows of a test; of one that says nothing else: nothing but the numbers of the fabric is given."""

    def given(self, run: RunT) -> tuple[str, ...]:
        """Results of ``run`` that were given to it as such: nothing computes them."""
        return ()

    def fed(self, run: RunT) -> RowKind:
        """Kind of the rows of a ``run`` at a scale that returns what it was fed."""
        return "input"

    def assumed(self, run: RunT) -> tuple[str, ...]:
        """Fields that decide the rows of ``run`` and are assumed, or another fabric's, which is then named."""
        return guessed(run.fabric, deciding(run))

    def gave(self, run: RunT, path: Path) -> str:
        """Part of the curve in ``path`` that ``run`` was given, besides the curves of its shells; empty if none."""
        return ""


#: of every test; each takes runs of its own kind, which only their name tells
ORIGINS: Mapping[str, Origin[Any]] = Parts(lambda kind: kind.load("origin")() if kind.origin else Origin())


def guessed(fabric: Fabric, fields: Sequence[str]) -> tuple[str, ...]:
    """Assumed ones of ``fields`` of ``fabric``, and those of another fabric, which is then named."""
    owners = borrowed(fabric)
    found = []
    for field in fields:
        if field in owners:
            found.append(f"{field} (from {owners[field]})")
        elif getattr(entry(fabric, field), "source", None) == "assumed":
            found.append(field)
    return tuple(found)
