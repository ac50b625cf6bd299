"""Where compiled kernels and relaxed cells are kept between runs."""

import os
import tempfile
from pathlib import Path


def cache_root() -> Path:
    """Writable cache folder: ``KNITTEST_CACHE_DIR``, else the user's cache folder, else a temporary one."""
    from platformdirs import user_cache_path

    candidates = [Path(os.environ["KNITTEST_CACHE_DIR"])] if os.environ.get("KNITTEST_CACHE_DIR") else []
    candidates += [user_cache_path("knittest"), Path(tempfile.gettempdir()) / f"knittest-cache-{os.getuid()}"]
    for folder in candidates:
        try:
            folder.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=folder):
                return folder
        except OSError:
            continue
    return Path(tempfile.mkdtemp(prefix="knittest-cache-"))
