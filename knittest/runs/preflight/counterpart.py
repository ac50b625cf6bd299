"""A number of a fabric file beside what else is known of it, from tests, curves, yarns or the relaxed cell."""

from dataclasses import dataclass, replace

from knittest.base.layout import table, wrapped
from knittest.config.base import Quantity
from knittest.config.fabric import Fabric
from knittest.experiment.borrowed import owner_of


@dataclass(frozen=True)
class Counterpart:
    """Quantity ``name`` [``unit``]: ``stated`` by ``field`` of the file (its ``source``), and ``found`` by ``origin``.

    ``found`` is None where nothing is known, and ``origin`` then says why. ``tolerance`` is the largest difference, in
    the unit, at which both agree: that of the method, or the scatter of the specimens. ``inputs`` are fields of the
    file that ``found`` was computed from. ``owner``: other fabric of ``field`` and of some of them.
    """

    name: str
    field: str
    unit: str
    stated: float
    source: str
    found: float | None
    origin: str
    tolerance: float = 0.0
    inputs: tuple[str, ...] = ()
    owner: str = ""

    @property
    def verdict(self) -> str:
        """Agrees, differs, no counterpart, or taken over: numbers of another fabric that agree confirm nothing."""
        if self.found is None:
            return "no counterpart"
        if abs(self.stated - self.found) > self.tolerance * (1.0 + 1e-9):
            return "differs"
        return "taken over" if self.owner else "agrees"

    @property
    def difference(self) -> float | None:
        """The file's number over its counterpart, less one [-]."""
        return self.stated / self.found - 1.0 if self.found else None

    def as_json(self) -> dict[str, object]:
        """All of it, for a program."""
        found = {
            "quantity": self.name, "field": self.field, "unit": self.unit, "in_file": self.stated,
            "source": self.source, "counterpart": self.found, "from": self.origin, "tolerance": self.tolerance,
        }  # fmt: skip
        share = self.difference
        return found | {"difference_pct": None if share is None else 100.0 * share, "verdict": self.verdict}


def of_quantity(
    name: str, field: str, unit: str, quantity: Quantity, found: float | None, origin: str, share: float = 0.0,
    inputs: tuple[str, ...] = (),
) -> Counterpart:  # fmt: skip
    """Counterpart of a ``quantity``, which agrees within ``share`` [-] of what was found."""
    tolerance = share * abs(found or 0.0)
    return Counterpart(name, field, unit, quantity.value, quantity.source, found, origin, tolerance, inputs)


def with_owner(row: Counterpart, fabric: Fabric) -> Counterpart:
    """``row`` with the other fabric that both of its numbers were taken from, if they were."""
    owner = owner_of(fabric, row.field)
    return replace(row, owner=owner) if owner and any(owner_of(fabric, name) for name in row.inputs) else row


def table_cells(rows: list[Counterpart]) -> list[tuple[str, ...]]:
    """The counterparts as cells of a table, with a head."""
    cells: list[tuple[str, ...]] = [
        ("quantity", "in the file", "", "counterpart", "difference", "verdict", "counterpart from")
    ]
    for row in rows:
        other = "-" if row.found is None else f"{row.found:.4g} {row.unit}".rstrip()
        share = row.difference
        difference = "-" if share is None else f"{100.0 * share:+.1f} %"
        said = f"{row.stated:.4g} {row.unit}".rstrip()
        cells.append((row.name, said, row.source, other, difference, row.verdict, row.origin))
    return cells


def table_lines(rows: list[Counterpart], width: int | None) -> list[str]:
    """:func:`table_cells` as lines; where they do not fit ``width``, a line of the verdict and one of both numbers."""
    lines = [line for row in table(table_cells(rows), indent="  ") for line in row]
    if width is None or max(map(len, lines)) <= width:
        return lines
    told = []
    for name, stated, source, other, difference, verdict, origin in table_cells(rows)[1:]:
        off = "" if difference == "-" else f", {difference}"
        found = origin if other == "-" else f"{other}: {origin}"
        told += wrapped(f"  {name}: {verdict}{off}", width)
        told += wrapped(f"      {stated} in the file ({source}); {found}", width)
    return told


def summary_line(rows: list[Counterpart]) -> str:
    """Count those that agree, differ and have none, and name those that differ."""
    counts = {v: [r.name for r in rows if r.verdict == v] for v in ("agrees", "differs", "no counterpart")}
    differ = counts["differs"]
    names = f": {', '.join(differ)}" if differ else ""
    owners = dict.fromkeys(row.owner for row in rows if row.verdict == "taken over")
    over = sum(row.verdict == "taken over" for row in rows)
    told = f"; {over} taken over from {', '.join(owners)} on both sides, which confirms nothing" if over else ""
    return (
        f"  {len(counts['agrees'])} agree, {len(differ)} differ{names}; {len(counts['no counterpart'])} without "
        f"counterpart{told}"
    )
