"""Options of a command that are not part of the test itself."""

from dataclasses import dataclass, field
from pathlib import Path

from knittest.base.figure import Printing


@dataclass(frozen=True)
class RunOptions:
    """Place and form of what a run reports: output folder, threads, JSON on stdout, silence, VTU frames, pictures with
    the report page; curves to compare with; formats of the pictures; the page in a browser; all notes below the table.
    """

    out: Path | None = None
    threads: int | None = None
    json: bool = False
    quiet: bool = False
    frames: bool = True
    pictures: bool = True
    against: tuple[Path, ...] = ()
    printing: Printing = field(default_factory=Printing)
    open_page: bool = False
    details: bool = False

    @property
    def left_out(self) -> list[str]:
        """Files that are not wanted, as the manifest names them."""
        return [name for name, wanted in (("frames", self.frames), ("pictures", self.pictures)) if not wanted]
