"""The rooms of the package: ten floors, as ARCHITECTURE.md and the import contracts state them; named files exist."""

import ast
import re
import tomllib
from graphlib import TopologicalSorter
from pathlib import Path

from knittest.fabric.cell import SOURCES
from knittest.studies.trials.trial import SOURCES_NOT_IN_KEY

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "knittest"
TEXT = (ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8")


def modules() -> dict[str, Path]:
    """Files of the package by dotted name."""
    paths = {".".join(path.relative_to(ROOT).with_suffix("").parts): path for path in PACKAGE.rglob("*.py")}
    return {name.removesuffix(".__init__"): path for name, path in paths.items()}


def imports(path: Path, known: dict[str, Path]) -> set[str]:
    """Modules of the package that the file at ``path`` names, at its head, in its functions, for types."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module:
            found |= {inner if (inner := f"{node.module}.{one.name}") in known else node.module for one in node.names}
        elif isinstance(node, ast.Import):
            found |= {one.name for one in node.names}
    return (found & set(known)) - {"knittest"}


def layers() -> list[set[str]]:
    """Floors of the import contract, the lowest first."""
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"][
        "contracts"
    ]
    return [set(re.findall(r"\w+", layer)) for layer in reversed(contracts[0]["layers"])]


def test_no_file_reads_another_in_a_circle():
    known = modules()
    order = TopologicalSorter({name: imports(path, known) - {name} for name, path in known.items()}).static_order()
    assert len(list(order)) == len(known) > 300


def test_a_room_reads_only_floors_below_its_own():
    floor = {f"knittest.{room}": number for number, rooms in enumerate(layers()) for room in rooms}
    known = modules()

    def room(name: str) -> str:
        return ".".join(name.split(".")[:2])

    wrong = [
        f"{name} -> {other}"
        for name, path in known.items()
        for other in imports(path, known)
        if name not in ("knittest", "knittest.__main__")
        and room(name) != room(other)
        and floor[room(name)] <= floor[room(other)]
    ]
    assert wrong == []


def test_every_room_is_on_one_of_ten_floors_and_few_modules_are_in_none():
    rooms = {path.name for path in PACKAGE.iterdir() if path.is_dir() and path.name not in ("__pycache__", "shipped")}
    loose = {path.stem for path in PACKAGE.glob("*.py")} - {"__init__", "__main__"}
    assert len(layers()) == 10 and len(loose) <= 8
    assert set.union(*layers()) == rooms | loose


def test_the_table_of_floors_is_the_contract():
    rows = re.findall(r"^\| (\d+) \| (.+?) \|", TEXT, re.MULTILINE)
    stated = {int(number): set(re.findall(r"`(\w+?)(?:/|\.py)`", rooms)) for number, rooms in rows}
    assert stated == dict(enumerate(layers(), 1))


def test_a_test_is_a_folder():
    """The entry points that an installation gets, and no other folder, are tests."""
    entries = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["entry-points"]
    folders = [name.replace("-", "_") for name in entries["knittest.tests"]]
    found = {path.name for path in (PACKAGE / "laboratory").iterdir() if (path / "test.py").is_file()}
    assert found == set(folders) and len(found) >= 5
    assert list(entries["knittest.tests"].values()) == [f"knittest.laboratory.{name}.kind:KIND" for name in folders]
    assert all((PACKAGE / "laboratory" / name / "report.py").is_file() for name in folders)


def test_lists_of_sources_name_what_is_there():
    """A file that moves without its entry would silently count, or not count, as one that results hang on."""
    assert [name for name in (*SOURCES_NOT_IN_KEY, *SOURCES) if not (PACKAGE / name).exists()] == []


def test_files_named_in_the_architecture_exist():
    paths = {path.relative_to(PACKAGE).as_posix() for path in PACKAGE.rglob("*.py")}
    named = set(re.findall(r"`((?:knittest/)?[\w/]+\.py)`", TEXT)) - {"tests/faults/test_snapshot.py"}
    missing = [
        name for name in named if not any(f"/{path}".endswith(f"/{name.removeprefix('knittest/')}") for path in paths)
    ]
    assert [name for name in missing if "NAME" not in name and name not in ("rig.py", "test.py", "report.py")] == []
