"""Page of a study, made from the files in its folder, and parts that the pages of all studies share."""

import io
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from knittest.base.files import write_atomic
from knittest.report_page.blocks import Block, Cell, Code, Page, Section, Table, Text
from knittest.report_page.files import Number, Reader
from knittest.report_page.page import target_file, write_page
from knittest.report_page.studies import file_to_save, problems

if TYPE_CHECKING:
    from pandas import DataFrame

#: table of all runs or points of a study
TABLE = "results.csv"
NOT_FINISHED = "Not finished; runs left: {}. Run the same command again to resume."


class Contents(NamedTuple):
    """Contents of a page: the ``name`` of the study and its ``state``, ``notes`` and ``facts`` of the summary, and the
    other sections with anchor, title and blocks.
    """

    name: str
    state: str
    notes: Sequence[Block]
    facts: Sequence[Block]
    sections: Sequence[tuple[str, str, Sequence[Block]]]


@dataclass(frozen=True)
class StudyPage:
    """Page of a ``kind`` of study whose folder has the files ``markers``; ``read`` makes its contents.

    ``read`` gets a reader of the folder and the folder of the page. A missing or damaged file is named on the page, and
    only its part is missing.
    """

    kind: str
    markers: tuple[str, ...]
    read: Callable[[Reader, Path], Contents]

    def is_in(self, folder: Path) -> bool:
        """Tell whether ``folder`` is the folder of such a study with a result."""
        return all((folder / name).is_file() for name in self.markers)

    def write(self, folder: Path, out: Path | None = None) -> Path:
        """Write the page of the study in ``folder`` into it, or to ``out``; raises as ``write_reports`` does."""
        target, reader = target_file([folder], out), Reader(folder)
        found = self.read(reader, target.parent)
        head = Section("summary", self.kind, [*found.notes, *problems(reader), *found.facts], 2)
        name = f"{self.kind} {found.name or folder.resolve().name}"
        return write_page(target, Page(name, found.state, [head, *(Section(*one, 2) for one in found.sections)]))


def facts_table(caption: str, facts: Mapping[str, str]) -> Table:
    """Table of ``facts`` by name; empty ones are left out."""
    return Table(caption, (), [(Cell(name), Cell(value)) for name, value in facts.items() if value])


def counts_text(counts: Mapping[str, int]) -> str:
    """``30 completed, 10 refused``."""
    return ", ".join(f"{count} {status}" for status, count in counts.items())


def runs_text(runs: int, counts: Mapping[str, int]) -> str:
    """``40 (30 completed, 10 refused)``."""
    return f"{runs}" + (f" ({counts_text(counts)})" if counts else "")


def warning_texts(warnings: Sequence[str]) -> list[Block]:
    """``warnings`` as notices."""
    return [Text(f"Warning: {text}.", "warn") for text in warnings]


def number_cell(value: Number, unit: str = "", note: str = "", form: str = "{:.5g}") -> Cell:
    """``value`` with its unit; a dash for a missing one."""
    if value is None or not math.isfinite(value):
        return Cell("-", note=note)
    return Cell(form.format(value) + unit_text(unit), value, note=note)


def unit_text(unit: str) -> str:
    """``unit`` to be written behind a number."""
    return f" {unit}" if unit not in ("", "1") else ""


def repeat_blocks(command: str, copy: str, caption: str, reader: Reader) -> list[Block]:
    """The command that repeats a study, and its file ``copy``."""
    code = Code(f"knittest {command} {copy}", f"Command; {copy} is the file below")
    return [code, *file_to_save(reader, copy, caption)]


def write_csv(table: "DataFrame", folder: Path) -> None:
    """Write ``table`` to :data:`TABLE` in ``folder``; raises :class:`ResourceError`."""
    text = io.StringIO()
    table.to_csv(text, index=False, float_format="%.10g")
    write_atomic(folder / TABLE, text.getvalue())
