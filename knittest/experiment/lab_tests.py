"""Laboratory tests that can be imported: how each is read, printed, written and recognised."""

import json
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Generic, TypeVar

from knittest.base.errors import InputError
from knittest.base.files import write_atomic
from knittest.base.kinds import DEFAULT, Parts, kinds
from knittest.config.fabric import Fabric, MacroMaterial
from knittest.config.templates import FABRIC
from knittest.experiment import lab_results, lab_units
from knittest.experiment.lab_conditions import Condition
from knittest.experiment.lab_results import Results, Tests
from knittest.experiment.lab_rows import read_rows
from knittest.experiment.lab_table import ReadOptions

#: fields of the rig, by test, from the statistics of an experiment by folder
Rigs = dict[str, dict[str, Any]]
#: options of the command on the meaning of a curve, by their names in ``Given``
SAID = ("sign", "zero", "preload", "faces", "clamped", "loading")
#: rows of a file that may name its test
_HEAD = 60
SpecimenT = TypeVar("SpecimenT")
HEAD = """\
# Part of a fabric file, written by knittest data import from the tests in this folder.
#   knittest new NAME --from FOLDER
# creates a fabric from it. The next import overwrites this file: edit the fabric instead.
"""


@dataclass(frozen=True)
class LabTest(Generic[SpecimenT]):
    """Functions to ``read`` a file into specimens and ``evaluate`` them to results.

    ``conditions`` and ``options`` are those of the command. The statistics of an import give the fields of its ``rig``,
    ``more_rigs`` from these by direction, and, with the folder of the files, those of the ``fabric``. ``show`` writes
    other lines than those of the results; ``check`` may raise an error before they are written.
    """

    name: str
    read: Callable[[Path, ReadOptions], list[SpecimenT]]
    evaluate: Callable[[Sequence[SpecimenT]], Results]
    conditions: tuple[Condition, ...] = ()
    options: tuple[str, ...] = ()
    rig: Callable[[dict[str, Any]], dict[str, float]] = lambda test: {}
    fabric: Callable[[Tests, Path], dict[str, Any]] = lambda tests, place: {}
    more_rigs: Callable[[Rigs], Rigs] | None = None
    show: Callable[[Sequence[SpecimenT]], list[str]] | None = None
    check: Callable[[Path, Results], None] = lambda out, results: None

    def results(self, specimens: Sequence[SpecimenT], direction: str = "", files: Sequence[str] = ()) -> Results:
        """Results of ``specimens``; raises :class:`InputError` if they are not one series."""
        found, names = self.evaluate(specimens), [getattr(s, "name", "") for s in specimens]
        return replace(found, test=self.name, direction=direction, files=files, names=names)

    def rigs(self, tests: Tests) -> Rigs:
        """Fields of rigs by test, and by direction if several have them."""
        each = {
            direction: self.rig(test)
            for direction, test in lab_results.statistics_by_direction(tests, self.name).items()
        }
        found = {
            d: {name: lab_units.round_number(value) for name, value in fields.items()}
            for d, fields in each.items()
            if fields
        }
        if not found or self.more_rigs:
            return self.more_rigs(found) if found and self.more_rigs else {}
        return {self.name: dict(found) if len(found) > 1 else next(iter(found.values()))}

    def lines(self, specimens: Sequence[SpecimenT]) -> list[str]:
        """Lines with results, mean and sd, conditions, and notes on the reading of the specimens, each once."""
        found: dict[str, list[str]] = {}
        for s in specimens:
            for note in getattr(s, "notes", ()):
                found.setdefault(note, []).append(getattr(s, "name", ""))
        notes = ["" if len(who) == len(specimens) else f"{', '.join(who)}: " for who in found.values()]
        own = self.show(specimens) if self.show else self.results(specimens).lines()
        return [*own, *(who + note for who, note in zip(notes, found, strict=True))]

    def write(
        self, specimens: Sequence[SpecimenT], out: Path, direction: str | None, files: Sequence[str],
        trusted: bool = False,
    ) -> str:  # fmt: skip
        """Write an experiment into ``out``; returns its variant. A ``trusted`` direction may contradict a file."""
        directed = kinds()[self.name].directional
        if directed and not direction:
            raise InputError(f"--direction: missing; state the yarns along the strips, warp or weft ({self.name})")
        if direction and not directed:
            raise self.unsupported_option_error("--direction")
        for said in (getattr(s, "said", None) for s in specimens if direction and not trusted):
            if said is not None and said.direction != direction:
                raise InputError(
                    f"{said.where} states {said.direction}, but --direction is {direction}; correct one, or give "
                    "--trust-direction to use the option"
                )
        results = self.results(specimens, direction or "", files)
        self.check(out, results)
        variant = lab_results.write_results(out, results)
        if not (out / lab_results.SOURCE_FILE).exists():
            write_atomic(out / lab_results.SOURCE_FILE, lab_results.source_text())
        write_atomic(out / FABRIC, HEAD + "\n".join(_yaml_lines(fabric_part(out), "")) + "\n")
        return variant

    def unsupported_option_error(self, option: str) -> InputError:
        """Error for an ``option`` that the test does not take."""
        own = [*(what.option for what in self.conditions if what.option), *(f"--{name}" for name in self.options)]
        return InputError(f"{option}: not an option of --test {self.name}, which takes {', '.join(own)}")


LAB_TESTS: Mapping[str, LabTest[Any]] = Parts(lambda kind: kind.load("laboratory"), "laboratory")


def fabric_part(out: Path) -> dict[str, Any]:
    """Fields of :class:`knittest.config.fabric.Fabric` from the imports in ``out``, in its order."""
    tests, place = lab_results.read_statistics(out), Path(*out.parts[1:]) if out.parts[:1] == ("data",) else out
    found: dict[str, Any] = {"experiment": place.as_posix(), "experiment_variant": out.resolve().name}
    macro: dict[str, Any] = {}
    rigs: Rigs = {}
    for lab in LAB_TESTS.values():
        part = lab.fabric(tests, place)
        macro |= part.pop("macro", {})
        rigs |= lab.rigs(tests)
        found |= part
    found |= {"macro": {name: macro[name] for name in MacroMaterial.model_fields if name in macro}, "rigs": rigs}
    return {name: found[name] for name in Fabric.model_fields if found.get(name)}


def _yaml_lines(part: dict[str, Any], indent: str) -> list[str]:
    """YAML of nested mappings; entries with a value or a kind are one line, as in the shipped fabrics."""
    found = []
    for name, value in part.items():
        if isinstance(value, dict) and not {"value", "kind"} & set(value):
            found += [f"{indent}{name}:", *_yaml_lines(value, indent + "  ")]
        else:
            text = re.sub(r'"(\w+)": ', r"\1: ", json.dumps(value, ensure_ascii=False))
            found.append(f"{indent}{name}: {text}")
    return found


def conditions() -> list[Condition]:
    """Conditions that any of the tests takes, each once."""
    return list({one.key: one for lab in LAB_TESTS.values() for one in lab.conditions}.values())


def read_files(test: str, files: Sequence[Path], options: Mapping[str, Any]) -> list[Any]:
    """Specimens of ``test`` in ``files``; ``options`` are those of the command by name, ``None`` if not given."""
    kind, stated = LAB_TESTS[test], {name: value for name, value in options.items() if value is not None}
    sizes = {what: stated[name] for what in conditions() if (name := what.option[2:].replace("-", "_")) in stated}
    said = {name: stated[name] for name in SAID if name in stated}
    useless = [what.option for what in sizes if what not in kind.conditions]
    if useless := useless + [f"--{name}" for name in said if name not in kind.options]:
        raise kind.unsupported_option_error(useless[0])
    given = ReadOptions(
        stated.get("decimal"), stated.get("delimiter"), sizes={what.key: value for what, value in sizes.items()},
        columns=tuple(name.strip() for name in stated["columns"].split(",")) if stated.get("columns") else (),
        named=dict(_parse_column(text) for text in stated.get("column", ())), **said,
    )  # fmt: skip
    found = []
    for path in files:
        try:
            found += kind.read(path, given)
        except InputError as error:  # of another test, by the head of the file or by its name?
            named = (name for name in LAB_TESTS if lab_units.matches(path.stem, "own_tests", name, "name"))
            other = recognise_test(path, given.delimiter) or next(named, test)
            hint = f"; for a {other} test, give --test {other}" if other != test else ""
            raise InputError(f"{error}{hint}") from None
    return found


def _parse_column(text: str) -> tuple[str, str]:
    """Name in lower case and role of a column in ``--column``."""
    role, equals, name = text.partition("=")
    role = {"strain": "extensometer"}.get(role.strip(), role.strip().replace("-", "_"))
    roles = [key for key in lab_units.name_table()["columns"] if key not in ("result", "rate", "transverse")]
    if not equals or role not in roles or not name.strip():
        raise InputError(f"--column {text}: expected ROLE=NAME, ROLE one of strain, {', '.join(roles)}")
    return name.strip(" \"'").lower(), role


def recognise_test(path: Path, delimiter: str | None = None) -> str:
    """Name of the test by the head and the columns of the file ``path``; empty if unknown."""
    try:
        rows = read_rows(path, delimiter)[:_HEAD]
    except InputError:
        return ""
    texts = [[cell for cell in row if not lab_units.NUMBER.match(cell)] for _, row in rows]
    return next((name for name in LAB_TESTS if lab_units.identifies_test(name, texts)), "")


def choose_test(test: str | None, files: Sequence[Path], delimiter: str | None = None) -> str:
    """Return ``test`` or the default; raises :class:`InputError` for a file that looks like another test."""
    for path in files if test is None else ():
        if other := recognise_test(path, delimiter):
            raise InputError(f"{path}: looks like a {other} test; give --test {other}, or --test {DEFAULT}")
    return test or DEFAULT
