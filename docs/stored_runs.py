"""Runs that pages quote, in docs/runs.json: options, the numbers they were given, results and where they come from.

``benchmarks/validation.py`` reads them from run folders. A stored run is stale as soon as its options mean other
numbers than it was given; what the same numbers give is guarded by ``knittest regress``.
"""

import json
import shlex
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

from knittest.config.fabric import YARN_LEVEL
from knittest.config.loading import resolve
from knittest.config.run import Run

FILE = Path(__file__).parent / "runs.json"
#: parts of a config that say where a number comes from, and of what no result hangs on
WORDS = ("source", "ref", "tuned_on", "chosen_by", "description", "title", "name", "experiment", "experiment_variant")
LIMITS = "solver.max_"
PARTS = ("rig", "fabric", "model", "solver", "variability")


@dataclass(frozen=True)
class StoredRun:
    """``options`` are arguments of ``resolve``; ``inputs`` the numbers it was given, by their path; ``results`` a
    number or mean, sd and values of an ensemble, flat; ``numerical_error`` as in summary.json, empty if not verified.
    """

    options: dict[str, Any]
    inputs: dict[str, Any]
    results: dict[str, Any]
    quality: dict[str, Any]
    cost: dict[str, Any]
    refused: list[str]
    warnings: list[str]
    commit: str
    date: str
    cpu: str
    numerical_error: dict[str, Any] = field(default_factory=dict)

    @property
    def command(self) -> str:
        """Command that repeats it."""
        given = {"direction": None, "parameters": "calibrated", "specimens": 1} | self.options
        words = ["knittest", given["test"]]
        for name in ("variant", "scale", "preset"):
            words += [f"--{name}", given[name]]
        words += ["--direction", given["direction"]] if given["direction"] else []
        words += ["--parameters", given["parameters"]] if given["parameters"] != "calibrated" else []
        words += ["--specimens", str(given["specimens"])] if given["specimens"] > 1 else []
        words += [word for text in given.get("sets", ()) for word in ("--set", text)]
        return shlex.join([*words, "--verify"] if self.numerical_error else words)

    @property
    def specimens(self) -> int:
        """Number of them that the results are of."""
        return int(self.options.get("specimens", 1))

    def run(self) -> Run:
        """Run that its options mean now."""
        return _resolved(json.dumps(self.options, sort_keys=True))

    def stale(self) -> list[str]:
        """Inputs that it was given and would not be given now."""
        return differences(self.inputs, self.run().model_dump(mode="json"))


@cache
def _resolved(options: str) -> Run:
    return resolve(**json.loads(options))


def inputs_of(config: Mapping[str, Any]) -> dict[str, Any]:
    """The numbers of a resolved config that its results hang on, by path."""
    found = {path: value for part in PARTS if part in config for path, value in _leaves(config[part], part)}
    unread = YARN_LEVEL if config["model"]["scale"] == "macro" else ("macro",)
    spared = (LIMITS, *(f"fabric.{name}." for name in unread))
    return {path: value for path, value in found.items() if not path.startswith(spared)}


def _leaves(value: Any, path: str) -> Iterator[tuple[str, Any]]:
    if not isinstance(value, Mapping):
        yield path, value
        return
    for name, inner in value.items():
        if name not in WORDS:
            yield from _leaves(inner, f"{path}.{name}")


def differences(before: Mapping[str, Any], config: Mapping[str, Any]) -> list[str]:
    """Inputs that a run was given and a resolved ``config`` does not give it now; a new field changes nothing."""
    given = inputs_of(config)
    return [
        f"{path} was {value}, is {given.get(path, 'not there')}"
        for path, value in before.items()
        if path not in given or given[path] != value
    ]


def packed(inputs: Mapping[str, Any], fabrics: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """``inputs`` with the name of their fabric in ``fabrics``, which holds the numbers of each once."""
    own = {path: value for path, value in inputs.items() if path.startswith("fabric.")}
    names = [name for name, known in fabrics.items() if known == own]
    name = names[0] if names else f"fabric {len(fabrics) + 1}"
    fabrics[name] = own
    return {"fabric": name} | {path: value for path, value in inputs.items() if path not in own}


def unpacked(inputs: Mapping[str, Any], fabrics: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """The inverse of :func:`packed`."""
    return {**fabrics[inputs["fabric"]], **{path: value for path, value in inputs.items() if path != "fabric"}}


def lines_of(fabrics: Mapping[str, Any], name: str, rows: Sequence[Any]) -> str:
    """JSON with a line a fabric and a line a row, so that a change shows where it is."""
    held = ",\n".join(f"{json.dumps(key)}: {json.dumps(own)}" for key, own in fabrics.items())
    lines = ",\n".join(json.dumps(row) for row in rows)
    return f'{{"fabrics": {{\n{held}\n}},\n"{name}": [\n{lines}\n]}}\n'


def load(file: Path = FILE) -> list[StoredRun]:
    """All stored runs."""
    data = json.loads(file.read_text(encoding="utf-8"))
    return [StoredRun(**run | {"inputs": unpacked(run["inputs"], data["fabrics"])}) for run in data["runs"]]


def save(runs: Sequence[StoredRun], file: Path = FILE) -> None:
    """Write ``runs`` in the order of their commands."""
    fabrics: dict[str, dict[str, Any]] = {}
    ordered = sorted(runs, key=lambda run: run.command)
    written = [asdict(run) | {"inputs": packed(run.inputs, fabrics)} for run in ordered]
    file.write_text(lines_of(fabrics, "runs", written), encoding="utf-8")
