"""Folders of the shipped configs and data: inside the package of a wheel, at the top level of a checkout."""

from pathlib import Path

#: folder of the package
PACKAGE = Path(__file__).resolve().parent.parent


def configs_dir() -> Path:
    """Folder of the shipped configs (``fabrics/``, ``rigs/``)."""
    return _shipped("configs")


def data_dir() -> Path:
    """Folder of the shipped experimental data, to which data paths in a config are relative."""
    return _shipped("data")


def _shipped(name: str) -> Path:
    in_wheel = PACKAGE / "shipped" / name
    return in_wheel if in_wheel.is_dir() else PACKAGE.parent / name
