"""Numba kernels: plain arrays in kernel units (mm, ms, g, N, MPa); nothing here knows of configs.

Importing this package points Numba's cache at a folder named after a hash of all kernel sources, because Numba
does not notice when a helper in another file was edited and would serve stale machine code.
"""

import hashlib
import os
from pathlib import Path

from knittest.cache import cache_root


def _source_digest() -> str:
    digest = hashlib.sha256()
    for source in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(source.name.encode() + source.read_bytes())
    return digest.hexdigest()[:16]


def cache_folder() -> Path:
    """Folder of the compiled kernels of this very source."""
    return cache_root() / "numba" / _source_digest()


#: rounds a thread spins at a barrier before it sleeps, unless the user's environment says otherwise: long enough to
#: cost
#: a lone run nothing (1000 costs a fifth), short enough to let others run: two runs side by side on two cores stood
#: still, 30 times slower each, with the default
SPIN_COUNT = "3000"


def _configure_numba() -> None:
    folder = cache_folder()
    os.environ["NUMBA_CACHE_DIR"] = str(folder)
    if "OMP_WAIT_POLICY" not in os.environ:
        os.environ.setdefault("GOMP_SPINCOUNT", SPIN_COUNT)
    import numba

    numba.config.CACHE_DIR = str(folder)
    numba.config.THREADING_LAYER_PRIORITY = ["omp", "tbb", "workqueue"]


_configure_numba()
