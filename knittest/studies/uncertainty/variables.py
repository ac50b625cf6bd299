"""Variables of a study: a quantity of one fabric, or its ratio between two, at one place; and statements on them."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import InputError
from knittest.base.history import Array
from knittest.config import studies as file
from knittest.config.messages import unknown_name_text
from knittest.config.yaml_loader import Document, value_excerpt

#: results of all fabrics: by fabric and result, over the design, NaN for a missing one
Numbers = Mapping[str, Mapping[str, Array]]


@dataclass(frozen=True)
class Variable:
    """Quantity of fabric ``of``, or its ratio ``of`` over ``over``, at the place ``at`` of its axis, if it has one."""

    quantity: str
    of: str
    over: str | None
    at: float | None
    result: str
    unit: str
    axis: str
    log: bool

    @property
    def who(self) -> str:
        """Fabric, or A/B."""
        return self.of if self.over is None else f"{self.of}/{self.over}"

    @property
    def name(self) -> str:
        """Name such as ``V2/V1 shear force, 20``."""
        return f"{self.who} {self.quantity}" + ("" if self.at is None else f", {self.at:g}")

    def values(self, numbers: Numbers) -> Array:
        """Values over the design, NaN where a number or a ratio is missing."""
        found = numbers[self.of][self.result]
        if self.over is None:
            return found
        below = numbers[self.over][self.result]
        return np.divide(found, below, out=np.full_like(found, np.nan), where=below != 0.0)

    def either_flag(self, flags: Mapping[str, NDArray[np.bool_]]) -> NDArray[np.bool_]:
        """Flags of the fabric, or of either fabric of a ratio, over the design."""
        return flags[self.of] if self.over is None else flags[self.of] | flags[self.over]


@dataclass(frozen=True)
class Statement:
    """Inequality between variables, the same at all places of their axis."""

    name: str
    of: list[Variable]
    below: list[Variable] | float | None
    above: list[Variable] | float | None

    @property
    def text(self) -> str:
        """Inequality in words, such as ``shear force of V2 below V1 at 10, 20``."""
        first = self.of[0]
        places = ", ".join(f"{one.at:g}" for one in self.of if one.at is not None)
        sides = [
            f"{word} {side[0].who if isinstance(side, list) else f'{side:g}'}"
            for word, side in (("below", self.below), ("above", self.above))
            if side is not None
        ]
        return f"{first.quantity} of {first.who} {' and '.join(sides)}" + (f" at {places}" if places else "")

    def holds(self, numbers: Numbers) -> Array:
        """1 where it holds at all places, 0 where it fails, NaN where a number is missing, over the design."""
        least = np.min(self._gaps(numbers), axis=(0, 1))  # NaN where one is
        return np.where(np.isfinite(least), least > 0.0, np.nan)

    def fails(self, numbers: Numbers) -> NDArray[np.bool_]:
        """Flags of points that fail at a place with numbers, for any missing numbers, over the design."""
        failing: NDArray[np.bool_] = np.any(self._gaps(numbers) <= 0.0, axis=(0, 1))
        return failing

    def _gaps(self, numbers: Numbers) -> Array:
        """Gaps between values and limits (limits, places, ...), above 0 where it holds, NaN without a number."""
        values, gaps = np.array([one.values(numbers) for one in self.of]), []
        for limit, sign in ((self.below, 1.0), (self.above, -1.0)):
            if limit is not None:
                end = np.array([one.values(numbers) for one in limit]) if isinstance(limit, list) else limit
                gaps.append(np.broadcast_to(sign * (end - values), values.shape))
        return np.array(gaps)


def results_of(quantity: file.StudyQuantity) -> list[str]:
    """Names of the results of ``quantity`` in a summary, one a place."""
    return [f"{quantity.result}.{at:g}" for at in quantity.at] or [quantity.result]


def variables_of(study: file.Uncertainty, document: Document) -> list[Variable]:
    """All variables: for each quantity those of the fabrics, then those of the ratios."""
    found = []
    for name, one in study.quantities.items():
        where = document.place_of(("quantities", name, "ratios"))
        for who in [*study.fabrics, *("/".join(pair) for pair in one.ratios)]:
            found += _variables_at_places(name, study, who, f"{where}: quantities.{name}.ratios")
    return found


def _variables_at_places(name: str, study: file.Uncertainty, who: str, where: str) -> list[Variable]:
    """Variables of the quantity ``name`` of ``who``, a fabric or A/B; raises :class:`InputError` with ``where``."""
    of, _, over = who.partition("/")
    for fabric in filter(None, (of, over)):
        if fabric not in study.fabrics:
            raise InputError(
                f"{where}: {value_excerpt(fabric)}: {unknown_name_text(fabric, list(study.fabrics), 'fabric')}"
            )
    one = study.quantities[name]
    unit = "1" if over else one.unit
    places: list[float | None] = [*one.at] or [None]
    return [
        Variable(name, of, over or None, at, result, unit, one.axis, one.spacing == "log")
        for at, result in zip(places, results_of(one), strict=True)
    ]


def statements_of(study: file.Uncertainty, document: Document) -> list[Statement]:
    """All statements; raises :class:`InputError` for an unknown quantity or fabric."""
    found = []
    for name, one in study.statements.items():
        where = f"{document.place_of(('statements', name))}: statements.{name}"
        if one.quantity not in study.quantities:
            known = unknown_name_text(one.quantity, list(study.quantities), "quantity")
            raise InputError(f"{where}.quantity = {value_excerpt(one.quantity)}: {known}")
        of = _variables_at_places(one.quantity, study, one.of, f"{where}.of")
        below, above = (
            _variables_at_places(one.quantity, study, side, f"{where}.{at}") if isinstance(side, str) else side
            for at, side in (("below", one.below), ("above", one.above))
        )
        found.append(Statement(name, of, below, above))
    return found
