"""Records of the laboratory's tests, one a test, found by entry points, with its share in the regression.

A record names what is heavy (models of its config, the test, its report) as ``module:name`` and holds what is light:
reading it imports no numpy, so that ``knittest --help`` is quick, and no room below the laboratory imports the
laboratory: they ask the record.
"""

import hashlib
import importlib
import importlib.util
import tomllib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from types import MappingProxyType
from typing import Any, TypeVar

from knittest.base.errors import InputError, is_out_of_memory
from knittest.base.files import PACKAGE


@dataclass(frozen=True)
class Regressed:
    """Runs of a regression: of ``specimens``, (variant, direction or None), with ``sets`` that ``label`` stands for,
    of the ``parameters`` of the fabric, None for its default set. What ``enlarges`` rounding has its scatter stored.

    Runs start by ``rank``, expensive ones first, so that no worker is left alone with one at the end.
    """

    rank: int
    level: str
    scale: str
    preset: str
    specimens: tuple[tuple[str, str | None], ...]
    sets: tuple[str, ...] = ()
    label: str | None = None
    parameters: str | None = None
    enlarges: bool = False


@dataclass(frozen=True)
class Regression:
    """A test in ``knittest regress``.

    ``rows`` of Table 3 that it gives, ``sets`` of all its runs, ``runs``; ``drift`` is the change that a number, a
    curve and a number that is nothing but buckles, one of ``buckled``, may have, by scale, where it is not everyone's
    and the scatter by rounding is not stored. ``crests`` count them, and change by whole ones.
    """

    rows: tuple[str, ...] = ()
    sets: tuple[str, ...] = ()
    runs: tuple[Regressed, ...] = ()
    drift: Mapping[str, tuple[float, float, float]] = field(default_factory=dict)
    buckled: tuple[str, ...] = ()
    crests: tuple[str, ...] = ()


#: all specimens of a test that is made along warp and weft, and of one that is not
STRIPS = (("1", "warp"), ("1", "weft"), ("2", "warp"), ("2", "weft"))
SHEETS = (("1", None), ("2", None))


#: group of the entry points; the name of one is that of its test, its value where the record is
GROUP = "knittest.tests"
#: test that a command or a file means unless it names one
DEFAULT = "tensile"
#: label and format of a result
Label = tuple[str, str]
#: what config file and command line state of a field of the rig, None without
Stated = Callable[[str], object]

T = TypeVar("T")
_NONE: Mapping[str, Any] = MappingProxyType({})


@dataclass(frozen=True)
class TestKind:
    """Record of all that the rest of knittest asks of a test; ``module:name`` stands for what is loaded when used.

    ``name`` is its command, ``rig.kind`` and the name of its entry point; ``summary`` and ``usage`` are what the help
    says; ``run`` is the model of its config, ``test`` and ``report`` are classes (:mod:`knittest.laboratory`).
    """

    __test__ = False  # nor one of pytest's

    name: str
    summary: str
    usage: str
    run: str
    test: str
    report: str
    #: its size in words, formatted with its ``rig``, and fields of the rig with length and width [mm] of its sheet of
    #: shells; or ``module:name`` of a function of a run that returns them
    size: str | tuple[str, ...] = ""
    sheet: str | tuple[str, str] = ""
    #: ``module:name`` of the share of its motion after which a run, with what is prepared of it, will have failed
    lasting: str = ""
    #: ``module:name`` of what ``knittest check`` looks at before its model is made: lines and numbers of a run, with a
    #: folder for pictures
    checked: str = ""
    #: ``module:name`` of what is known of the errors of its results
    corrections: str = ""
    #: ``module:name`` of the study that its pages show beside a run with these results
    study: str = ""
    #: field of a run that ends the test at a shear angle [deg]
    sheared_to: str = ""
    #: ``module:name`` of how a run is ended sooner (:class:`knittest.laboratory.records.Ending`), None where it is not
    ending: str = ""
    #: where its deck for another solver says its force; none is written of a test without
    deck_force: str = ""
    #: place among the tests in help and tables, and whether it is on a strip along warp or weft
    place: int = 100
    directional: bool = True
    #: tools touch its specimen, which is a periodic cell: its steps are compiled for them
    tools: bool = False
    periodic: bool = False
    #: its forces hang on the shear of the fabric
    shears: bool = False
    #: options of the command for numbers of the rig: field and help by name
    shortcuts: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    #: the same for words
    texts: Mapping[str, tuple[str, str]] = field(default_factory=dict)

    #: label and format of each result, in the order of tables; what grows with the specimen: the same without a size
    labels: Mapping[str, Label] = field(default_factory=dict)
    sized: Mapping[str, str] = field(default_factory=dict)
    #: results that say how well a run went, not what it found
    diagnostic: tuple[str, ...] = ()
    #: published quantities that it predicts, what lists of tuned rows call them, and the same row by another name
    published: tuple[str, ...] = ()
    row_names: Mapping[str, str] = field(default_factory=dict)
    other_names: Mapping[str, str] = field(default_factory=dict)

    #: quantity of tables that measures a field of its rig
    measured: Mapping[str, str] = field(default_factory=dict)

    #: files that it leaves besides those of every run: pictures, and tables (CSV)
    pictures: tuple[str, ...] = ()
    tables: tuple[str, ...] = ()

    #: scales at which there is such a test
    scales: tuple[str, ...] = ("macro", "meso")
    #: scale unless one is asked for; ``module:name`` of what a preset sets; fields of the rig that a preset decides
    scale: str = "meso"
    presets: str = ""
    sizes: tuple[str, ...] = ()
    #: field of the rig that is of the same piece as another: who states the other does not want a fabric's own
    tied: Mapping[str, str] = field(default_factory=dict)
    #: fields that decide its results, by scale ({d}: the direction), and scales at which it returns its input
    deciding: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    fed: tuple[str, ...] = ()
    #: ``module:name`` of what its rows come from, where its runs are given more than the fabric
    origin: str = ""

    #: gates of its own by key, and fields of its rig that a gate hangs on with the sign of the looser side
    gates: tuple[str, ...] = ()
    hinges: Mapping[str, int] = field(default_factory=dict)
    #: ``module:name`` of the rules of advice by gate, where those of all tests do not hold
    advice: str = ""
    #: field that is halved to see whether the speed matters, with its unit, by scale; change that counts as converged
    halved: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    converged: float = 0.02
    #: whether it is a row of the speed study if none is asked for
    studied: bool = False
    #: its part of ``knittest regress``
    regression: Regression = field(default_factory=lambda: Regression())
    #: ``module:name`` of how files of a testing machine are read
    laboratory: str = ""

    @property
    def own_fields(self) -> dict[str, str]:
        """Fields of the options that only its command has, by their names in Python."""
        return {name.replace("-", "_"): field for name, (field, _) in {**self.shortcuts, **self.texts}.items()}

    def load(self, part: str) -> Any:
        """Object that the field ``part`` names or states; raises :class:`InputError` where it is not there."""
        value = getattr(self, part)
        return value if isinstance(value, tuple) else _object(value, f"test {self.name}: {part}")


@cache
def kinds() -> Mapping[str, TestKind]:
    """Read the records of all installed tests, by name and in their order.

    Raises :class:`InputError` where one cannot be loaded, two have one name or label a result differently, or a test
    of knittest itself is not installed.
    """
    entries: dict[str, EntryPoint] = {}
    for entry in _entries():
        other = entries.setdefault(entry.name, entry)
        if other.value != entry.value:
            offers = f"{_package(other)} and {_package(entry)}"
            raise InputError(f"test {entry.name}: two packages offer it, {offers}: uninstall one")
    _refuse_missing({entry.value.partition(":")[0] for entry in entries.values()})
    found = {name: _record(entry) for name, entry in entries.items()}
    return MappingProxyType(dict(sorted(found.items(), key=lambda item: (item[1].place, item[0]))))


def _entries() -> Iterator[EntryPoint]:
    """Entry points of all tests; in a checkout its own are those that it states, whatever it stated when installed."""
    own = _of_checkout(PACKAGE.parent / "pyproject.toml")
    yield from own
    for entry in entry_points(group=GROUP):
        if not own or entry.dist is None or entry.dist.name != PACKAGE.name:
            yield entry


def _of_checkout(path: Path) -> list[EntryPoint]:
    """Entry points of tests in the pyproject.toml of a checkout at ``path``; none where there is no checkout."""
    if not path.is_file():
        return []
    project = tomllib.loads(path.read_text(encoding="utf-8")).get("project", {})
    stated = project.get("entry-points", {}).get(GROUP, {}) if project.get("name") == PACKAGE.name else {}
    return [EntryPoint(name, value, GROUP) for name, value in stated.items()]


def _record(entry: EntryPoint) -> TestKind:
    where = f"test {entry.name} of {_package(entry)}: entry point {entry.value}"
    record = _object(entry.value, where)
    if not isinstance(record, TestKind):
        raise InputError(f"{where}: expected a knittest.base.kinds.TestKind, found a {type(record).__name__}")
    if record.name != entry.name:
        raise InputError(f"{where}: its record is named {record.name}: name both alike")
    return record


def _object(path: str, where: str) -> Any:
    module, colon, name = path.partition(":")
    if not colon:
        raise InputError(f"{where}: expected module:name, found {path!r}")
    try:
        return getattr(importlib.import_module(module), name)
    except Exception as error:  # a package of somebody else may fail in any way
        if is_out_of_memory(error):
            raise
        raise InputError(f"{where}: cannot be loaded: {error}: repair or uninstall the package") from error


def package_digest(kind: TestKind) -> dict[str, str]:
    """Digest of the sources of the packages that the test of ``kind`` comes from, where they are not knittest."""
    parts = (kind.run, kind.test, kind.report)
    packages = sorted({part.partition(":")[0].partition(".")[0] for part in parts} - {PACKAGE.name})
    if not packages:
        return {}
    digest = hashlib.sha256()
    for package in packages:
        found = importlib.util.find_spec(package)
        folders = list(found.submodule_search_locations or ()) if found else []
        files = [path for folder in folders for path in Path(folder).rglob("*.py")]
        for path in sorted(files or ([Path(found.origin)] if found and found.origin else [])):
            digest.update(path.name.encode() + path.read_bytes())
    return {"test": digest.hexdigest()}


def _package(entry: EntryPoint) -> str:
    if entry.dist is None:
        return f"{PACKAGE.name}, this checkout" if entry.value.startswith(f"{PACKAGE.name}.") else "an unknown package"
    return f"{entry.dist.name} {entry.dist.version}"


def _refuse_missing(stated: set[str]) -> None:
    """Raise :class:`InputError` where a folder of the laboratory holds a record that no entry point names."""
    here = {f"knittest.laboratory.{path.parent.name}.kind" for path in PACKAGE.glob("laboratory/*/kind.py")}
    if missing := sorted(here - stated):
        raise InputError(
            f"knittest's own tests are not installed ({', '.join(missing)}): the entry points of its installation are "
            f"older than its code, or there is none; run: pip install {PACKAGE.parent} (with -e for a checkout)"
        )


class Parts(Mapping[str, T]):
    """A part of each test by the test's name, made by ``make`` when it is asked for and kept; of those tests whose
    record has a ``part``, if one is named.
    """

    def __init__(self, make: Callable[[TestKind], T], part: str = "") -> None:
        self._make, self._part, self._made = make, part, dict[str, T]()

    def __getitem__(self, name: str) -> T:
        if name not in self._made:
            self._made[name] = self._make(kinds()[name])
        return self._made[name]

    def __contains__(self, name: object) -> bool:
        return name in names(self._part)

    def __iter__(self) -> Iterator[str]:
        return iter(names(self._part))

    def __len__(self) -> int:
        return len(names(self._part))


class Joined(Mapping[str, T]):
    """Entries of all tests in one: of their records' maps ``part``; two that state one differently are refused."""

    def __init__(self, part: str, more: Mapping[str, T] = _NONE) -> None:
        self._part, self._more, self._all = part, more, dict[str, T]()

    def __getitem__(self, name: str) -> T:
        return self._joined()[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._joined())

    def __len__(self) -> int:
        return len(self._joined())

    def _joined(self) -> dict[str, T]:
        if not self._all:
            found = dict(self._more)
            for kind in kinds().values():
                for name, value in getattr(kind, self._part).items():
                    if found.setdefault(name, value) != value:
                        raise InputError(
                            f"test {kind.name}: {self._part}: {name} is {found[name]!r} of another test: state the "
                            "same, or choose another name"
                        )
            self._all = found
        return self._all


def listed(part: str) -> tuple[str, ...]:
    """Entries of all tests' tuples ``part``, each once."""
    return tuple(dict.fromkeys(name for kind in kinds().values() for name in getattr(kind, part)))


def names(part: str = "") -> list[str]:
    """Names of the tests, of those whose record has a ``part`` if one is named."""
    return [name for name, kind in kinds().items() if not part or getattr(kind, part)]
