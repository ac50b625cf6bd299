"""Identity of a run: all that its bits depend on, and the differences between a checkpoint and now."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import knittest
from knittest.base.kinds import kinds, package_digest
from knittest.base.resources import data_dir
from knittest.config.dumping import dump
from knittest.config.run import Run
from knittest.config.tools import stl_tools
from knittest.export import provenance
from knittest.fabric.cell_cache import cell_digest
from knittest.fabric.relax import relaxed_cell

#: libraries that do the arithmetic
ARITHMETIC = ("numpy", "numba", "llvmlite", "scipy")
#: settings without influence on the result
FREE = ("output.checkpoint_interval", "output.verify")

Identity = dict[str, Any]


def identity_of(run: Run, data_files: Iterable[Path]) -> Identity:
    """Version, kernels, libraries, processor, config, data and relaxed cell of ``run`` here and now."""
    versions = provenance.library_versions()
    cell = cell_of(run)
    return {
        "version": knittest.__version__,
        "kernels": kernel_digest(),
        "libraries": {name: versions.get(name, "") for name in ARITHMETIC},
        "cpu": provenance.cpu_model(),
        "config_sha256": provenance.sha256_text(dump(run)),
        "config": run.model_dump(mode="json"),
        "data": provenance.sha256_files(data_files),
        **({"cell": cell} if cell else {}),
        **package_digest(kinds()[run.rig.kind]),
    }


def cell_of(run: Run, compute: Callable[[], None] | None = None) -> str | None:
    """Digest of the relaxed cell that the yarns of ``run`` are made of; None for shells.

    ``compute`` is called before a cell is relaxed that was not before.
    """
    if run.model.scale == "macro":
        return None
    return cell_digest(relaxed_cell(run.fabric, compute))


def data_files(run: Run) -> list[Path]:
    """Files that the numbers of ``run`` come from besides its config: curves, tables of its experiment, tools."""
    fabric, root = run.fabric, data_dir()
    curves = [root / name for name in fabric.macro.curve_files.values()]
    tables = sorted((root / fabric.experiment).glob("*.csv")) if fabric.experiment else []
    tools = [root / stl.path for stl in stl_tools(run.rig).values()]
    return [path for path in (*curves, *tables, *tools) if path.is_file()]


def kernel_digest() -> str:
    """Digest of the kernel sources that this process loaded; those on disk may have changed since.

    A process that compiles has other last bits than one that loads from the cache: without one, it says so.
    """
    from knittest.kernels import CODE_FOLDER, SOURCE_DIGEST

    return SOURCE_DIGEST if CODE_FOLDER is not None else f"{SOURCE_DIGEST} compiled without a cache"


def changes(before: Mapping[str, object], now: Mapping[str, object]) -> list[str]:
    """Changes, one text each: ``solver.damping was 0.5, is 0.6``; empty when the bits must come out the same."""
    old, new = (dict(_leaves({k: v for k, v in i.items() if k != "config_sha256"})) for i in (before, now))
    names = {k: k.removeprefix("config.") for k in sorted(old.keys() | new.keys())}
    return [
        f"{name} was {old.get(key, 'not there')}, is {new.get(key, 'not there')}"
        for key, name in names.items()
        if old.get(key) != new.get(key) and name not in FREE
    ]


def _leaves(value: object, path: str = "") -> Iterator[tuple[str, Any]]:
    if isinstance(value, Mapping) and value:
        for key, item in value.items():
            yield from _leaves(item, f"{path}.{key}" if path else str(key))
    else:
        yield path, value
