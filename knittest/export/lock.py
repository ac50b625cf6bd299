"""One run, one folder: a lock that the operating system frees when its process dies."""

import errno
import fcntl
import json
import os
from contextlib import suppress
from pathlib import Path

from knittest.base.atomic import resource_error
from knittest.base.errors import ResourceError
from knittest.base.hiding import host_name

LOCK_NAME = "run.lock"
# Blanks after the owner's line keep some room on a full disk for the last manifest, see RunLock.give_room.
_PADDING = 65536


class RunLock:
    """An exclusive lock of a folder; ``stale_owner`` describes a dead process whose lock was taken over."""

    def __init__(self, folder: Path) -> None:
        """Take the lock of ``folder``; raise :class:`ResourceError` when a living run holds it."""
        self.path = folder / LOCK_NAME
        try:
            self._handle = self._open()
        except OSError as error:
            raise resource_error(self.path, error) from error
        self.stale_owner = _describe(self._read())
        try:
            self._write_owner()
        except OSError as error:
            self.release()
            raise resource_error(self.path, error) from error

    def _open(self) -> int:
        while True:
            handle = os.open(self.path, os.O_RDWR | os.O_CREAT, 0o644)
            try:
                fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
                # The owner before us may have removed the file between our open and our lock: then try again.
                if os.path.samestat(os.fstat(handle), self.path.stat()):
                    return handle
            except FileNotFoundError:
                pass
            except OSError as error:
                owner = _describe(os.pread(handle, 4096, 0)) or "an unknown process"
                os.close(handle)
                if error.errno in (errno.EAGAIN, errno.EACCES):
                    raise ResourceError(
                        f"{self.path.parent}: in use by {owner}; wait for it, or a process that it began, to end or "
                        "choose another folder with --out"
                    ) from None
                raise
            os.close(handle)

    def _read(self) -> bytes:
        return os.pread(self._handle, 4096, 0)

    def _write_owner(self) -> None:
        owner = json.dumps({"pid": os.getpid(), "host": host_name()}) + "\n"
        os.ftruncate(self._handle, 0)
        os.pwrite(self._handle, owner.encode().ljust(_PADDING), 0)
        os.fsync(self._handle)

    @property
    def descriptor(self) -> int:
        """File descriptor that holds the lock, also in a process that inherits it."""
        return self._handle

    def give_room(self) -> None:
        """Hand the reserved blocks back to the disk, so that the last manifest finds room on a full one."""
        with suppress(OSError):
            os.ftruncate(self._handle, 0)
            os.fsync(self._handle)

    def release(self) -> None:
        """Remove the lock file and free the lock; harmless when called twice."""
        if self._handle < 0:
            return
        with suppress(OSError):
            self.path.unlink(missing_ok=True)
        os.close(self._handle)
        self._handle = -1


def is_locked(folder: Path) -> bool:
    """Tell whether a process holds the lock of ``folder``."""
    try:
        handle = os.open(folder / LOCK_NAME, os.O_RDONLY | os.O_NOFOLLOW)
    except OSError:
        return False
    try:
        fcntl.flock(handle, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except OSError:
        return True
    finally:
        os.close(handle)
    return False


def _describe(content: bytes) -> str | None:
    """``process 123 on host`` from the content of a lock; None when it is empty."""
    if not content.strip():
        return None
    try:
        owner = json.loads(content)
        where = f" on {owner['host']}" if owner["host"] else ""
        return f"process {int(owner['pid'])}{where}"
    except (ValueError, KeyError, TypeError):
        return "an unknown process"
