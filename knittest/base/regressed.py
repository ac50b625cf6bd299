"""A test's share in the regression: which runs, which rows, how far they may drift."""

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Regressed:
    """Runs of a regression: of ``specimens``, (variant, direction or None), with ``sets`` that ``label`` stands for,
    of the ``parameters`` of the fabric, None for its default set. What ``enlarges`` rounding has its scatter stored.

    Runs start by ``rank``, expensive ones first, so that no worker is left alone with one at the end.
    """

    rank: int
    level: str
    scale: str
    preset: str
    specimens: tuple[tuple[str, str | None], ...]
    sets: tuple[str, ...] = ()
    label: str | None = None
    parameters: str | None = None
    enlarges: bool = False


@dataclass(frozen=True)
class Regression:
    """A test in ``knittest regress``.

    ``rows`` of Table 3 that it gives, ``sets`` of all its runs, ``runs``; ``drift`` is the change that a number, a
    curve and a number that is nothing but buckles, one of ``buckled``, may have, by scale, where it is not everyone's
    and the scatter by rounding is not stored. ``crests`` count them, and change by whole ones.
    """

    rows: tuple[str, ...] = ()
    sets: tuple[str, ...] = ()
    runs: tuple[Regressed, ...] = ()
    drift: Mapping[str, tuple[float, float, float]] = field(default_factory=dict)
    buckled: tuple[str, ...] = ()
    crests: tuple[str, ...] = ()


#: all specimens of a test that is made along warp and weft, and of one that is not
STRIPS = (("1", "warp"), ("1", "weft"), ("2", "warp"), ("2", "weft"))
SHEETS = (("1", None), ("2", None))
