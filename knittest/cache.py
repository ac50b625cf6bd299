"""Where compiled kernels and relaxed cells are kept between runs."""

import getpass
import os
import tempfile
import warnings
from functools import cache
from pathlib import Path

VARIABLE = "KNITTEST_CACHE_DIR"


def cache_root() -> Path:
    """Writable cache folder: ``KNITTEST_CACHE_DIR``, else the user's cache folder.

    Where that cannot be written it is one in the system's folder for temporary files, and a warning says so.
    """
    from platformdirs import user_cache_path

    given = os.environ.get(VARIABLE)
    return _writable(Path(given) if given else user_cache_path("knittest"))


@cache
def _writable(folder: Path) -> Path:
    if _can_write(folder):
        return folder
    spare = Path(tempfile.gettempdir()) / f"knittest-cache-{_user()}"
    if not _can_write(spare):
        spare = Path(tempfile.mkdtemp(prefix="knittest-cache-"))
    warnings.warn(f"{folder} cannot be written: caching in {spare}; set {VARIABLE} to a writable folder", stacklevel=3)
    return spare


def _can_write(folder: Path) -> bool:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False


def _user() -> str:
    try:
        return getpass.getuser()
    except (OSError, KeyError):  # no entry for this user id, as in some containers
        return str(os.getuid())
