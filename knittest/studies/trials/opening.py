"""Opens the folder of a trial: new, or to go on in from the checkpoint of a process that died."""

import shutil
from contextlib import suppress
from pathlib import Path

from knittest.base.atomic import resource_error
from knittest.base.errors import InputError
from knittest.base.interrupts import Interrupts
from knittest.config.run import Run
from knittest.export.lock import RunLock
from knittest.runs.opening import Opened, open_again, open_new


def open_trial(run: Run, data_files: list[Path], interrupts: Interrupts, *, path: Path) -> Opened:
    """Go on with what is in ``path`` if that leads to the same result, else start anew in it.

    Raises :class:`ResourceError` when another process is in the folder, or when it cannot be written.
    """
    if (path / "config.yaml").is_file():
        with suppress(InputError):  # another processor, another library, a damaged manifest
            return open_again(run, data_files, interrupts, path=path, force=False)
    if path.exists():
        _clear(path)
    return open_new(run, data_files, interrupts, out=path)


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
