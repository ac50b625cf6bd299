"""Reads the files of run folders; a missing, damaged or older part costs only that part."""

import io
import json
import re
from collections.abc import Iterable, Iterator, Mapping
from itertools import takewhile
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeVar, cast

import numpy as np
from pydantic import AfterValidator, BaseModel, BeforeValidator, ValidationError

from knittest.base.errors import InputError
from knittest.base.files import read_regular, replace_file
from knittest.base.result_rows import result_rows
from knittest.base.summary import Summary as Written
from knittest.config.aliases import present_field, present_results

if TYPE_CHECKING:
    from pandas import DataFrame

MAX_JSON = 5_000_000
MAX_TABLE = 50_000_000
#: characters of a message that a page shows
LONGEST_PROBLEM = 600
#: characters of the name of a sheet in a workbook, at most
SHEET_NAME_LENGTH = 31

Columns = dict[str, np.ndarray]
Number = float | None


class Spread(BaseModel):
    """A result of an ensemble."""

    mean: Number
    sd: Number
    values: list[Number]


class ComparedRow(BaseModel):
    """A result compared with a published value."""

    quantity: str
    simulated: Number = None
    experiment_mean: Number = None
    experiment_sd: Number = None
    deviation_sd: Number = None
    deviation_pct: Number = None
    kind: str = ""
    source: str = ""
    scaled: str = ""
    modelled: Number = None
    factors: list[float] = []
    assumed: list[str] = []
    given: bool = False


class RelaxedLimit(BaseModel):
    """A limit relaxed against the preset, with the present name of its field."""

    name: Annotated[str, AfterValidator(present_field)]
    value: Number = None
    preset: Number = None
    unit: str = ""
    accepted: bool = False


class PeaksAfterFailure(BaseModel):
    """Peaks after the first failure, where the quality checks end."""

    specimens: int
    first_failure_pct: list[float]
    peak_pct: list[float]


class Summary(BaseModel):
    """summary.json."""

    rig: str = ""
    variant: str = ""
    scale: str = ""
    direction: str = ""
    results: dict[str, Number | Spread | dict[str, Number | Spread]] = {}
    quality: dict[str, Number] = {}
    cost: dict[str, Number] = {}
    comparison: list[ComparedRow] = []
    kinds: dict[str, str] = {}
    assumed: list[str] = []
    refused: list[str] = []
    warnings: list[str] = []
    numerical_error: dict[str, dict[str, Number | str]] = {}
    verification: dict[str, object] = {}
    limits: list[RelaxedLimit] = []
    rest: Annotated[dict[str, Number | Spread | dict[str, Number | Spread]], BeforeValidator(present_results)] = {}
    unjudged: PeaksAfterFailure | None = None

    def plain(self) -> Written:
        """The same as plain data, as the run writes it."""
        return cast("Written", self.model_dump())


class Manifest(BaseModel):
    """manifest.json; a missing field is empty."""

    status: str = ""
    version: str = ""
    git_commit: str | None = None
    config_sha256: str = ""
    data_sha256: dict[str, str] = {}
    seed: int | None = None
    cpu: str = ""
    threads: int | None = None
    libraries: dict[str, str] = {}
    started: str | None = None
    ended: str | None = None
    exit_code: int | None = None
    message: str = ""
    resumed: list[dict[str, object]] = []

    def facts(self) -> dict[str, str]:
        """Versions, processor and data of the run by label, where they are stated."""
        facts = {"knittest": self.version, "commit": self.git_commit, "processor": self.cpu, "threads": self.threads}
        facts |= {f"{name}, SHA-256": digest for name, digest in self.data_sha256.items()} | self.libraries
        return {name: str(value) for name, value in facts.items() if value not in (None, "")}


class Comparison(BaseModel):
    """comparison.json: metrics against each reference curve."""

    curves: list[dict[str, object]] = []


Model = TypeVar("Model", bound=BaseModel)


class Reader:
    """Reads the files of ``folder`` and collects its ``problems``."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.problems: list[str] = []

    def add_problem(self, problem: object) -> None:
        """Note a problem, without the path of the folder."""
        text = "; ".join(str(problem).replace(f"{self.folder}/", "").splitlines())
        self.problems.append(text if len(text) <= LONGEST_PROBLEM else text[:LONGEST_PROBLEM] + " ...")

    def raw(self, name: str, limit: int) -> bytes | None:
        """Bytes of a file; ``None`` and a problem if it cannot be read."""
        try:
            return read_regular(self.folder / name, limit, "a run writes less")
        except InputError as error:
            self.add_problem(error)
            return None

    def model(self, name: str, model: type[Model]) -> Model:
        """Contents of a JSON file as ``model``; invalid fields have their default."""
        raw = self.raw(name, MAX_JSON)
        if raw is None:
            return model()
        try:
            data = json.loads(raw)
            if not isinstance(data, Mapping):
                raise ValueError(f"expected an object, found {type(data).__name__}")
        except (ValueError, RecursionError) as error:
            self.add_problem(f"{name}: cannot be read: {error}")
            return model()
        try:
            return model.model_validate(data)
        except ValidationError as error:
            for finding in error.errors():
                where = ".".join(str(part) for part in finding["loc"])
                self.add_problem(f"{name}: {where}: {finding['msg']}")
            bad = {finding["loc"][0] for finding in error.errors()}
            return model.model_validate({key: value for key, value in data.items() if key not in bad})

    def table(self, name: str) -> Columns:
        """Numeric columns of a CSV file, empty if it cannot be read."""
        import pandas as pd

        table = self.frame(name)
        if table is None:
            return {}
        numbers = table.apply(pd.to_numeric, errors="coerce").dropna(axis="columns", how="all")
        if numbers.empty:
            self.add_problem(f"{name}: has no numbers")
        return {str(column): numbers[column].to_numpy(float) for column in numbers}

    def frame(self, name: str) -> "DataFrame | None":
        """A CSV file as it is, ``None`` if it cannot be read."""
        import pandas as pd

        raw = self.raw(name, MAX_TABLE)
        if raw is None:
            return None
        try:
            return pd.read_csv(io.BytesIO(raw))
        except (ValueError, OverflowError, pd.errors.ParserError) as error:
            self.add_problem(f"{name}: cannot be read: {error}")
            return None


def write_workbook(folder: Path, target: Path) -> list[str]:
    """Write the tables in ``folder`` and its folders to a workbook, a sheet each, with a sheet of all results.

    Returns the names of the sheets. Raises :class:`InputError` without a table or without openpyxl.
    """
    try:
        import openpyxl  # noqa: F401
    except ImportError:
        raise InputError("export xlsx: openpyxl is not installed: pip install 'knittest[xlsx]'") from None
    import pandas as pd

    if target.suffix != ".xlsx":
        raise InputError(f"--out {target}: expected a file that ends with .xlsx")
    results: list[str] = []
    sheets = {"results": (results, found)} if not (found := pd.DataFrame(_result_rows(folder))).empty else {}
    for path in (*sorted(folder.glob("*.csv")), *sorted(folder.glob("*/*.csv"))):
        lines = read_regular(path, MAX_TABLE, "a table has less").decode("utf-8", errors="replace").splitlines()
        head = list(takewhile(lambda line: line.startswith("#"), lines))
        name = _sheet_name(" ".join(path.relative_to(folder).with_suffix("").parts), sheets)
        try:
            sheets[name] = (head, pd.read_csv(io.StringIO("\n".join(lines[len(head) :]))))
        except ValueError as error:
            raise InputError(f"{path}: not a table: {error}") from None
    if not sheets:
        raise InputError(f"{folder}: has no table (CSV)")
    with replace_file(target) as temporary, pd.ExcelWriter(temporary, engine="openpyxl") as writer:
        for name, (head, table) in sheets.items():
            table.to_excel(writer, sheet_name=name, index=False, startrow=len(head))
            for k, line in enumerate(head):
                writer.sheets[name].cell(row=k + 1, column=1, value=line)
    return list(sheets)


def _sheet_name(text: str, others: Iterable[str]) -> str:
    """``text`` as a valid name of a sheet that differs from ``others``, whatever the capitals."""
    text, known = re.sub(r"[\[\]:*?/\\]", "_", text), {other.lower() for other in others}
    names = (text[-SHEET_NAME_LENGTH:], *(f"{text[: SHEET_NAME_LENGTH - 5]} {k}" for k in range(2, len(known) + 3)))
    return next(name for name in names if name.lower() not in known)


def _result_rows(folder: Path) -> Iterator[dict[str, object]]:
    for path in (*folder.glob("summary.json"), *sorted(folder.glob("*/summary.json"))):
        summary = Reader(path.parent).model(path.name, Summary)
        for row in result_rows(summary.plain(), refused=bool(summary.refused)):
            yield {
                "run": path.parent.name, "quantity": row.label, "simulated": row.value, "experiment": row.experiment,
                "deviation": row.deviation, "kind": row.kind_text, "verdict": row.verdict,
            }  # fmt: skip
