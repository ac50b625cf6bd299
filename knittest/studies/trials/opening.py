"""Opens the folder of a trial: new, or to go on in from the checkpoint of a process that died."""

import shutil
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from knittest.base.atomic import resource_error
from knittest.base.errors import InputError
from knittest.base.interrupts import Interrupts
from knittest.config.run import Run
from knittest.export.lock import RunLock
from knittest.runs.opening import NewFolder, Opened, StoppedRun


@dataclass(frozen=True)
class TrialFolder:
    """The folder of a trial: gone on in where that leads to the same result, else begun anew."""

    path: Path

    def open(self, run: Run, interrupts: Interrupts) -> Opened:
        """Open it; raises :class:`ResourceError` when another process is in it, or when it cannot be written."""
        if (self.path / "config.yaml").is_file():
            with suppress(InputError):  # another processor, another library, a damaged manifest
                return StoppedRun(self.path).open(run, interrupts)
        if self.path.exists():
            _clear(self.path)
        return NewFolder(self.path).open(run, interrupts)


def _clear(path: Path) -> None:
    lock = RunLock(path)
    try:
        for entry in path.iterdir():
            if entry == lock.path:
                continue
            if entry.is_dir():
                shutil.rmtree(entry)
            else:
                entry.unlink()
    except OSError as error:
        raise resource_error(path, error) from error
    finally:
        lock.release()
