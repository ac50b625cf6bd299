"""Settled cells on disk, keyed by all that enters them: the fabric, the mesh, the step, and every source that shapes
or moves yarns.
"""

import hashlib
import json
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from knittest.base.cache import cache_folder
from knittest.base.kept import keep, kept
from knittest.base.notes import tell
from knittest.base.sealed import Damaged
from knittest.config.run import Run

#: rooms whose sources decide how a cell comes to rest
ROOMS = ("base", "config", "fabric", "kernels", "materials", "models", "solve")
DIGITS = 24

Numbers = dict[str, Any]


def remembered(run: Run, what: Numbers, compute: Callable[[], Numbers]) -> Numbers:
    """Plain numbers of the settled cell of ``run`` under the conditions ``what``: those kept, or computed and kept."""
    key = settled_key(run, what)
    folder = cache_folder("settled")
    path = None if folder is None else folder / f"{key}.npz"
    try:
        arrays = kept(path, key)
        if arrays is not None:
            found: Numbers = json.loads(str(arrays["numbers"]))
            return found
    except (Damaged, KeyError, ValueError) as error:
        tell(f"{path}: {error}: this settled cell is not used; it is settled anew")
    numbers = compute()
    text = json.dumps(numbers)
    keep(path, key, {"numbers": np.array(text)})
    again: Numbers = json.loads(text)
    return again


def settled_key(run: Run, what: Numbers) -> str:
    """Digest of the fabric, mesh and step of ``run``, of ``what``, and of the sources."""
    entering = {
        "fabric": run.fabric.model_dump(mode="json"),
        "meso": run.model.meso.model_dump(mode="json"),
        "solver": run.solver.model_dump(mode="json", include={"safety", "target_step", "max_added_mass"}),
        "what": what,
    }
    digest = hashlib.sha256(json.dumps(entering, sort_keys=True).encode())
    digest.update(_sources().encode())
    return digest.hexdigest()[:DIGITS]


@cache
def _sources() -> str:
    """Digest of all sources in :data:`ROOMS`, as this process found them first."""
    package = Path(__file__).parent.parent
    digest = hashlib.sha256()
    for room in ROOMS:
        for source in sorted((package / room).glob("*.py")):
            digest.update(f"{room}/{source.name}".encode() + source.read_bytes())
    return digest.hexdigest()
