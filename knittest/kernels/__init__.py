"""Numba kernels: plain arrays in kernel units (mm, ms, g, N, MPa); no configuration enters here.

Importing this package sets Numba's cache to a folder named after a hash of all kernel sources: Numba does not notice
that a function in another file was edited, and would serve stale machine code. Without a private folder nothing is
cached, because Numba unpickles what it finds there.
"""

import hashlib
import os
from pathlib import Path

from knittest.base.cache import cache_folder


def _source_digest() -> str:
    digest = hashlib.sha256()
    for source in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(source.name.encode() + source.read_bytes())
    return digest.hexdigest()[:16]


#: digest of the kernel sources that this process loaded; the files may change later
SOURCE_DIGEST = _source_digest()
#: folder of their machine code; None without a cache
CODE_FOLDER = cache_folder("numba", SOURCE_DIGEST)

#: rounds a thread spins at a barrier before it sleeps, unless the user's environment says otherwise: long enough to
#: cost a lone run nothing (1000 costs a fifth), short enough to let others run: two runs side by side on two cores
#: stood still, 30 times slower each, with the default
SPIN_COUNT = "3000"


def _configure_numba() -> None:
    folder = "" if CODE_FOLDER is None else str(CODE_FOLDER)
    os.environ["NUMBA_CACHE_DIR"] = folder
    if "OMP_WAIT_POLICY" not in os.environ:
        os.environ.setdefault("GOMP_SPINCOUNT", SPIN_COUNT)
    import numba

    numba.config.CACHE_DIR = folder
    if CODE_FOLDER is not None:
        from knittest.kernels.code_cache import keep_code_in

        keep_code_in(CODE_FOLDER)
    numba.config.THREADING_LAYER_PRIORITY = ["omp", "tbb", "workqueue"]


_configure_numba()
