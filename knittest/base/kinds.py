"""Records of the tests, found by entry points.

A record names heavy parts (config models, test, report) as ``module:name`` and holds light ones itself. Reading it
imports no numpy, so that ``knittest --help`` is quick, and packages below the laboratory need not import it.
"""

import hashlib
import importlib
import importlib.util
import tomllib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache, cached_property
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from types import MappingProxyType
from typing import Any, TypeVar

from knittest.base.errors import InputError, is_out_of_memory
from knittest.base.files import PACKAGE


@dataclass(frozen=True)
class RegressionRuns:
    """Runs of a regression: ``specimens`` (variant, direction or None) with ``sets`` under ``label``.

    ``parameters`` is the parameter set, None for the default. Runs start by ``rank``, expensive ones first.
    ``enlarges``: rounding errors grow, so that the scatter by rounding is stored too.
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
    """Part of a test in ``knittest regress``: ``rows`` of Table 3 that it gives, ``runs``, and ``sets`` of all of them.

    ``drift`` is the tolerance of a number, of a curve and of a number in ``buckled``, by scale, if it is not the
    general one and no scatter by rounding is stored. ``crests`` are counts, which change by whole numbers.
    """

    rows: tuple[str, ...] = ()
    sets: tuple[str, ...] = ()
    runs: tuple[RegressionRuns, ...] = ()
    drift: Mapping[str, tuple[float, float, float]] = field(default_factory=dict)
    buckled: tuple[str, ...] = ()
    crests: tuple[str, ...] = ()


#: all specimens of a test with directions, and of one without
STRIPS = (("1", "warp"), ("1", "weft"), ("2", "warp"), ("2", "weft"))
SHEETS = (("1", None), ("2", None))


#: group of the entry points: name of the test, place of its record
GROUP = "knittest.tests"
#: default test of commands and files
DEFAULT = "tensile"
#: label and format of a result
Label = tuple[str, str]
#: function that returns the value of a rig field in config file and command line, or None
Stated = Callable[[str], object]

T = TypeVar("T")
_NONE: Mapping[str, Any] = MappingProxyType({})


@dataclass(frozen=True)
class TestKind:
    """Record of a test; ``module:name`` is the place of an object that is loaded when used.

    ``name`` is its command, ``rig.kind`` and the name of its entry point; ``summary`` and ``usage`` are help texts;
    ``run`` is the model of its config, ``test`` and ``report`` are classes (:mod:`knittest.laboratory`).
    """

    __test__ = False  # no test of pytest

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
    #: ``module:name`` of an early part of ``knittest check``: lines and numbers of a run, and pictures in a folder
    checked: str = ""
    #: ``module:name`` of known errors of its results
    corrections: str = ""
    #: ``module:name`` of the study that its pages show with a run
    study: str = ""
    #: field of a run that ends the test at a shear angle [deg]
    sheared_to: str = ""
    #: ``module:name`` of how a run is ended sooner (:class:`knittest.laboratory.records.EndSetting`)
    ending: str = ""
    #: place of the force in its deck for LS-DYNA; empty: it has no deck
    deck_force: str = ""
    #: ``module:name`` of its curve from the motions and reactions of the nodes that it moves, in a run of its deck for
    #: OpenRadioss; empty: it has no such deck
    deck_curve: str = ""
    #: position among the tests in help and tables; whether it is on a strip along warp or weft
    place: int = 100
    directional: bool = True
    #: tools touch its specimen; its specimen is a periodic cell: kernels are compiled for them
    tools: bool = False
    periodic: bool = False
    #: its forces depend on the shear of the fabric
    shears: bool = False
    #: options of the command for numbers and for texts of the rig: field and help by name
    shortcuts: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    texts: Mapping[str, tuple[str, str]] = field(default_factory=dict)

    #: label and format of each result, in the order of tables; results that grow with the specimen: the same per size
    labels: Mapping[str, Label] = field(default_factory=dict)
    sized: Mapping[str, str] = field(default_factory=dict)
    #: results on the quality of a run
    diagnostic: tuple[str, ...] = ()
    #: published quantities that it predicts, their names in lists of tuned rows, and other names of the same row
    published: tuple[str, ...] = ()
    row_names: Mapping[str, str] = field(default_factory=dict)
    other_names: Mapping[str, str] = field(default_factory=dict)

    #: quantity of tables that measures a field of its rig
    measured: Mapping[str, str] = field(default_factory=dict)

    #: additional files: pictures and tables (CSV)
    pictures: tuple[str, ...] = ()
    tables: tuple[str, ...] = ()

    #: possible scales, the default one; ``module:name`` of the settings of presets; rig fields that a preset sets
    scales: tuple[str, ...] = ("macro", "meso")
    scale: str = "meso"
    presets: str = ""
    sizes: tuple[str, ...] = ()
    #: rig field of the same specimen as another: if the other is given, the default of the fabric does not apply
    tied: Mapping[str, str] = field(default_factory=dict)
    #: fields that decide its results, by scale ({d}: the direction); scales at which it only returns its input
    deciding: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    fed: tuple[str, ...] = ()
    #: ``module:name`` of the origin of its rows, if its runs depend on more than the fabric
    origin: str = ""

    #: own quality checks by key, and rig fields on which a check depends, with the sign of the looser side
    checks: tuple[str, ...] = ()
    hinges: Mapping[str, int] = field(default_factory=dict)
    #: ``module:name`` of own rules of advice by quality check
    advice: str = ""
    #: field that is halved to study the influence of speed, with its unit, by scale; change that counts as converged
    halved: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    converged: float = 0.02
    #: whether the speed study has it by default
    studied: bool = False
    #: part in ``knittest regress``
    regression: Regression = field(default_factory=lambda: Regression())
    #: ``module:name`` of the reader of files of a testing machine
    laboratory: str = ""

    @property
    def own_fields(self) -> dict[str, str]:
        """Rig fields of the options that only its command has, by their names in Python."""
        return {name.replace("-", "_"): field for name, (field, _) in {**self.shortcuts, **self.texts}.items()}

    def load(self, part: str) -> Any:
        """Object that the field ``part`` names or states; raises :class:`InputError` where it is not there."""
        value = getattr(self, part)
        return value if isinstance(value, tuple) else _load_object(value, f"test {self.name}: {part}")


@cache
def kinds() -> Mapping[str, TestKind]:
    """Records of all installed tests by name; raises :class:`InputError` for a broken, missing or duplicate one."""
    entries: dict[str, EntryPoint] = {}
    for entry in _entries():
        other = entries.setdefault(entry.name, entry)
        if other.value != entry.value:
            offers = f"{_package_name(other)} and {_package_name(entry)}"
            raise InputError(f"test {entry.name} is in two packages, {offers}: uninstall one of them")
    stated = {entry.value.partition(":")[0] for entry in entries.values()}
    here = {f"knittest.laboratory.{path.parent.name}.kind" for path in PACKAGE.glob("laboratory/*/kind.py")}
    if missing := sorted(here - stated):
        raise InputError(
            f"tests of knittest are not installed ({', '.join(missing)}): the installation is older than the code, or "
            f"missing; run: pip install {PACKAGE.parent} (with -e for a checkout)"
        )
    found = {name: _load_record(entry) for name, entry in entries.items()}
    return MappingProxyType(dict(sorted(found.items(), key=lambda item: (item[1].place, item[0]))))


def _entries() -> Iterator[EntryPoint]:
    """Entry points of all tests; those of a checkout are read from its pyproject.toml, not from its installation."""
    own = _checkout_entries(PACKAGE.parent / "pyproject.toml")
    yield from own
    for entry in entry_points(group=GROUP):
        if not own or entry.dist is None or entry.dist.name != PACKAGE.name:
            yield entry


def _checkout_entries(path: Path) -> list[EntryPoint]:
    """Entry points of tests in the pyproject.toml of a checkout at ``path``; none without a checkout."""
    if not path.is_file():
        return []
    project = tomllib.loads(path.read_text(encoding="utf-8")).get("project", {})
    stated = project.get("entry-points", {}).get(GROUP, {}) if project.get("name") == PACKAGE.name else {}
    return [EntryPoint(name, value, GROUP) for name, value in stated.items()]


def _load_record(entry: EntryPoint) -> TestKind:
    where = f"test {entry.name} of {_package_name(entry)}: entry point {entry.value}"
    record = _load_object(entry.value, where)
    if not isinstance(record, TestKind):
        raise InputError(f"{where}: expected a knittest.base.kinds.TestKind, found a {type(record).__name__}")
    if record.name != entry.name:
        raise InputError(f"{where}: its record is named {record.name}: give both the same name")
    return record


def _load_object(path: str, where: str) -> Any:
    module, colon, name = path.partition(":")
    if not colon:
        raise InputError(f"{where}: expected module:name, found {path!r}")
    try:
        return getattr(importlib.import_module(module), name)
    except Exception as error:  # a package of somebody else may fail in any way
        if is_out_of_memory(error):
            raise
        raise InputError(f"{where} cannot be loaded: {error}: repair or uninstall the package") from error


def package_digest(kind: TestKind) -> dict[str, str]:
    """Digest of the sources of the packages of the test ``kind``, without knittest."""
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


def check_method_names(owner: type, present: Mapping[str, str]) -> None:
    """Raise :class:`InputError` if ``owner`` has a method with an old name, which nothing calls any more.

    ``present`` has the present name of each old one.
    """
    for old, name in present.items():
        if hasattr(owner, old):
            raise InputError(f"{owner.__module__}:{owner.__qualname__}: {old} is now called {name}: rename the method")


def _package_name(entry: EntryPoint) -> str:
    if entry.dist is None:
        return f"{PACKAGE.name}, this checkout" if entry.value.startswith(f"{PACKAGE.name}.") else "an unknown package"
    return f"{entry.dist.name} {entry.dist.version}"


class Parts(Mapping[str, T]):
    """Lazy mapping from test to the object that ``make`` makes of its record; only tests with a ``part``, if named."""

    def __init__(self, make: Callable[[TestKind], T], part: str = "") -> None:
        self._make, self._part, self._made = make, part, dict[str, T]()

    def __getitem__(self, name: str) -> T:
        if name not in self._made:
            self._made[name] = self._make(kinds()[name])
        return self._made[name]

    def __contains__(self, name: object) -> bool:
        return name in test_names(self._part)

    def __iter__(self) -> Iterator[str]:
        return iter(test_names(self._part))

    def __len__(self) -> int:
        return len(test_names(self._part))


class JoinedParts(Mapping[str, T]):
    """Joined mappings ``part`` of all records; raises :class:`InputError` if two tests contradict each other."""

    def __init__(self, part: str, more: Mapping[str, T] = _NONE) -> None:
        self._part, self._more = part, more

    def __getitem__(self, name: str) -> T:
        return self._merged[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._merged)

    def __len__(self) -> int:
        return len(self._merged)

    @cached_property
    def _merged(self) -> dict[str, T]:
        found = dict(self._more)
        for kind in kinds().values():
            for name, value in getattr(kind, self._part).items():
                if found.setdefault(name, value) != value:
                    raise InputError(
                        f"test {kind.name}: {self._part}: {name} is {found[name]!r} in another test: use the same, or "
                        "choose another name"
                    )
        return found


def list_part(part: str) -> tuple[str, ...]:
    """Entries of the tuples ``part`` of all records, each once."""
    return tuple(dict.fromkeys(name for kind in kinds().values() for name in getattr(kind, part)))


def test_names(part: str = "") -> list[str]:
    """Names of the tests; only those whose record has a ``part``, if named."""
    return [name for name, kind in kinds().items() if not part or getattr(kind, part)]
