"""Identity and origin of a run: versions, commit, hashes, machine, and changes since a checkpoint."""

import hashlib
import platform
import subprocess
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any

import knittest
from knittest.base.errors import InputError
from knittest.base.files import data_dir
from knittest.base.kinds import kinds, package_digest
from knittest.config.run import Run
from knittest.config.tools import stl_tools
from knittest.config.yaml_writer import dump
from knittest.fabric.cell import cell_digest
from knittest.fabric.relaxation import relaxed_cell, start_of_relaxation

_LIBRARIES = ("llvmlite", "matplotlib", "meshio", "numba", "numpy", "pandas", "pydantic", "PyYAML", "scipy")


@cache
def library_versions() -> dict[str, str]:
    """Versions of Python and of the libraries that numbers or files depend on."""
    versions = {"python": platform.python_version()}
    for name in _LIBRARIES:
        with suppress(metadata.PackageNotFoundError):
            versions[name] = metadata.version(name)
    return versions


def git_commit() -> str | None:
    """Commit of the checkout that holds the package, ``-dirty`` when changed; None for an installed package."""
    checkout = Path(knittest.__file__).resolve().parents[1]
    if not (checkout / ".git").exists():
        return None
    command = ["git", "-C", str(checkout), "describe", "--always", "--dirty", "--abbrev=40", "--exclude=*"]
    try:
        done = subprocess.run(command, capture_output=True, encoding="utf-8", timeout=5, check=True)
    except (OSError, subprocess.SubprocessError):
        return None
    return done.stdout.strip() or None


def cpu_model() -> str:
    """Name of the processor; results are bitwise identical only on the same model."""
    with suppress(OSError):
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines():
            if line.lower().startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()


def sha256_text(text: str) -> str:
    """Hash of a text as UTF-8."""
    return hashlib.sha256(text.encode()).hexdigest()


def sha256_files(paths: Iterable[Path]) -> dict[str, str]:
    """Hash of each file, keyed by its folder's and its own name; raise :class:`InputError` for an unreadable one."""
    hashes = {}
    for path in paths:
        try:
            with path.open("rb") as stream:
                hashes["/".join(path.parts[-2:])] = hashlib.file_digest(stream, "sha256").hexdigest()
        except OSError as error:
            raise InputError(f"{path}: cannot read this data file: {error.strerror}") from error
    return hashes


#: libraries that do the arithmetic
ARITHMETIC = ("numpy", "numba", "llvmlite", "scipy")
#: settings without influence on the result
FREE = ("output.checkpoint_interval", "output.verify")

Identity = dict[str, Any]


def identity_of(run: Run, data_files: Iterable[Path], config_text: str | None = None) -> Identity:
    """Version, kernels, libraries, processor, config, data and relaxed cell of ``run`` here and now.

    ``config_text`` is the dumped run where it is known.
    """
    versions = library_versions()
    cell = cell_of(run)
    return {
        "version": knittest.__version__,
        "kernels": kernel_digest(),
        "libraries": {name: versions.get(name, "") for name in ARITHMETIC},
        "cpu": cpu_model(),
        "config_sha256": sha256_text(dump(run) if config_text is None else config_text),
        "config": run.model_dump(mode="json"),
        "data": sha256_files(data_files),
        **({"cell": cell} if cell else {}),
        **package_digest(kinds()[run.rig.kind]),
    }


def cell_of(run: Run, compute: Callable[[], None] | None = None) -> str | None:
    """Digest of the relaxed cell of a meso ``run``; None at macro scale. ``compute`` is called before a relaxation."""
    if run.model.scale == "macro":
        return None
    return cell_digest(relaxed_cell(start_of_relaxation(run.fabric), compute))


def data_files(run: Run) -> list[Path]:
    """Data files of ``run`` besides its config: curves, tables of its experiment, tools."""
    fabric, root = run.fabric, data_dir()
    curves = [root / name for name in fabric.macro.curve_files.values()]
    tables = sorted((root / fabric.experiment).glob("*.csv")) if fabric.experiment else []
    tools = [root / stl.path for stl in stl_tools(run.rig).values()]
    return [path for path in (*curves, *tables, *tools) if path.is_file()]


def kernel_digest() -> str:
    """Digest of the kernel sources that this process loaded, which may have changed on disk since.

    It also states if there is no cache: freshly compiled kernels round differently in the last bits.
    """
    from knittest.kernels import CODE_FOLDER, SOURCE_DIGEST

    return SOURCE_DIGEST if CODE_FOLDER is not None else f"{SOURCE_DIGEST} compiled without a cache"


def changes(before: Mapping[str, object], now: Mapping[str, object]) -> list[str]:
    """List the changes, such as ``solver.damping was 0.5, is 0.6``; empty if results must be bitwise identical."""
    old, new = (dict(_leaf_values({k: v for k, v in i.items() if k != "config_sha256"})) for i in (before, now))
    names = {k: k.removeprefix("config.") for k in sorted(old.keys() | new.keys())}
    return [
        f"{name} was {old.get(key, 'missing')}, is {new.get(key, 'missing')}"
        for key, name in names.items()
        if old.get(key) != new.get(key) and name not in FREE
    ]


def _leaf_values(value: object, path: str = "") -> Iterator[tuple[str, Any]]:
    if isinstance(value, Mapping) and value:
        for key, item in value.items():
            yield from _leaf_values(item, f"{path}.{key}" if path else str(key))
    else:
        yield path, value
