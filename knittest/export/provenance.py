"""Origin of a run: versions, commit, hashes, machine."""

import hashlib
import os
import platform
import subprocess
from collections.abc import Iterable
from importlib import metadata
from pathlib import Path

import knittest
from knittest.base.errors import InputError

_LIBRARIES = ("llvmlite", "matplotlib", "meshio", "numba", "numpy", "pandas", "pydantic", "PyYAML", "scipy")


def library_versions() -> dict[str, str]:
    """Versions of Python and of the libraries that numbers or files depend on."""
    versions = {"python": platform.python_version()}
    for name in _LIBRARIES:
        try:
            versions[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    return versions


def git_commit() -> str | None:
    """Commit of the checkout that holds the package, ``-dirty`` when changed; None for an installed package."""
    checkout = Path(knittest.__file__).resolve().parents[1]
    if not (checkout / ".git").exists():
        return None
    command = ["git", "-C", str(checkout), "describe", "--always", "--dirty", "--abbrev=40", "--exclude=*"]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=5, check=True)
    except (OSError, subprocess.SubprocessError):
        return None
    return done.stdout.strip() or None


def cpu_model() -> str:
    """Name of the processor: the same bits are promised on one model only."""
    try:
        with Path("/proc/cpuinfo").open(encoding="utf-8", errors="replace") as lines:
            for line in lines:
                if line.lower().startswith("model name"):
                    return line.partition(":")[2].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()


def cores() -> int:
    """Cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


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
