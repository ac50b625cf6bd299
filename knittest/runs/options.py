"""Options of a command that do not change the test."""

from dataclasses import dataclass, field
from pathlib import Path

from knittest.base.figure import Printing


@dataclass(frozen=True)
class RunOptions:
    """Output of a run: folder, threads, JSON, frames, pictures, curves to compare with, page, notes, explanations."""

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
    explained: bool = False

    @property
    def left_out(self) -> list[str]:
        """Names of the files not to be written, for the manifest."""
        return [name for name, wanted in (("frames", self.frames), ("pictures", self.pictures)) if not wanted]
