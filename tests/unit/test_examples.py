"""Examples in docstrings run, and show what they say."""

import doctest
import importlib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
#: modules with an example; that of pose compiles kernels and runs with its tests
SHOWING = [
    path
    for path in sorted((ROOT / "knittest").rglob("*.py"))
    if ">>> " in path.read_text(encoding="utf-8") and path.name != "pose.py"
]


def test_there_are_examples() -> None:
    names = {path.relative_to(ROOT / "knittest").as_posix() for path in SHOWING}
    assert {"base/units.py", "experiment/statistics.py", "materials/trellis.py", "materials/heavy_elastica.py"} <= names


@pytest.mark.parametrize("path", SHOWING, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_examples_run(path: Path) -> None:
    name = ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
    found = doctest.testmod(importlib.import_module(name))
    assert found.attempted and not found.failed
