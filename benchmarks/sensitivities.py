"""Measures which test fixes which parameter of the yarns: d ln(result) / d ln(parameter), a table in docs/identify.md.

python benchmarks/sensitivities.py FOLDER [TEST ...] runs what is missing in FOLDER, one run at a time, and writes the
table when all tests are there. Some 25 minutes of one processor.
"""

import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import yaml

from benchmarks.forming import put, table
from knittest.cli.main import run
from knittest.config.loading import resolve

#: ratio of the stiffness in torsion to that in bending, as the fabric has it where it states none
TORSION = {"fabric.knitting.torsion_ratio.value": 0.77}
#: factors on a parameter, and of runs that differ by rounding alone on the first
FACTORS, ROUNDING = (1.2, 0.8), (1.0 + 1e-9, 1.0 - 1e-9)


@dataclass(frozen=True)
class Parameter:
    """Fields that change as powers of one factor, 1.2 and 0.8, from what the fabric has, or from ``start`` where it has
    none: these come last. Of a share it may be the ``rest`` to 1 that changes.
    """

    name: str
    powers: dict[str, float]
    start: float | None = None
    rest: bool = False

    def changed(self, values: dict[str, float], factor: float) -> dict[str, float]:
        """Values of its fields, which are ``values`` unless there is a start, with ``factor``."""
        found = {}
        for field, power in self.powers.items():
            value = values[field] if self.start is None else self.start
            new = 1.0 - (1.0 - value) * factor**power if self.rest else value * factor**power
            found[field] = float(f"{new:.12g}")
        return found


@dataclass(frozen=True)
class Tested:
    """Settings of a test, small enough for many runs, and names of its results as columns of the table."""

    base: dict[str, Any]
    settings: dict[str, Any]
    results: dict[str, str]


CONTACT, LOOPS, INLAYS = "fabric.contact", "fabric.knitting", "fabric.reinforcing"
PARAMETERS = (
    Parameter("mu", {f"{CONTACT}.friction_coefficient.value": 1.0}),
    Parameter("EI of the loops", {f"{LOOPS}.bending_stiffness.value": 1.0, f"{LOOPS}.torsion_ratio.value": -1.0}),
    Parameter("GJ of the loops", {f"{LOOPS}.torsion_ratio.value": 1.0}),
    Parameter("1 - degree of set", {f"{LOOPS}.degree_of_set.value": 1.0}, rest=True),
    Parameter("EI and GJ of the inlays", {f"{INLAYS}.bending_stiffness.{d}.value": 1.0 for d in ("warp", "weft")}),
    Parameter("normal stiffness", {f"{CONTACT}.normal_stiffness.value": 1.0}),
    Parameter(
        "patch radius",
        {f"{CONTACT}.patch.radius.{pair}.value": 1.0 for pair in ("inlay_inlay", "inlay_loop", "loop_loop")},
    ),
    Parameter("crimp", {f"{INLAYS}.crimp.{d}.value": 1.0 for d in ("warp", "weft")}),
    Parameter("loop shortening, from 1 %", {f"{LOOPS}.draw_in": 1.0}, start=1.0),
)
TESTS = {
    "pull-out": Tested(
        {"direction": "weft"},
        {"rig.travel": 4.2},
        {
            "pull_out_at_rest_n": "force at rest [N]", "pull_out_peak_n": "largest force [N]",
            "pull_out_sliding_n": "sliding force [N]",
        },
    ),
    "compaction": Tested(
        {},
        {"rig.side": 10, "rig.max_pressure": 100},
        {
            "thickness_mm_at_kpa.1": "1 kPa [mm]", "thickness_mm_at_kpa.100": "100 kPa [mm]",
            "compaction_work_j_per_m2": "compaction [J/m²]",
        },
    ),
    "picture-frame": Tested(
        {},
        {"rig.side": 20, "rig.max_angle": 15, "rig.cycles": 1},
        {
            "cycle_work_mj": "shear [mJ]", "cycle_loss_mj": "loss [mJ]",
            "cycle_residual_angle_deg": "angle at zero force [deg]",
        },
    ),
}  # fmt: skip


def base_of(test: str) -> dict[str, Any]:
    """Part of a sweep that all runs of ``test`` share."""
    one = TESTS[test]
    shared = {"test": test, "variant": "1", "scale": "meso", "preset": "quick", "parameters": "spin-friction"}
    return shared | one.base | {"set": one.settings}


def values_of(test: str) -> dict[str, float]:
    """Value of each field that changes and that the fabric of ``test`` has, as its runs start from it."""
    sets = [f"{name}={value}" for name, value in TORSION.items()]
    given = resolve(test=test, variant="1", scale="meso", preset="quick", parameters="spin-friction", sets=sets)
    return {name: _number(given, name) for one in PARAMETERS if one.start is None for name in one.powers}


def _number(given: Any, name: str) -> float:
    for part in name.split("."):
        given = getattr(given, part)
    return float(given)


def sweeps_of(test: str) -> Iterator[tuple[str, list[dict[str, float]]]]:
    """Sweeps of ``test``: name and points of the run at the start, of those that round differently and two of each
    parameter, and of each parameter that the fabric does not have.
    """
    values, own = values_of(test), [one for one in PARAMETERS if one.start is None]
    changes = [(own[0], 1.0), *((own[0], factor) for factor in ROUNDING)]
    changes += [(one, factor) for one in own for factor in FACTORS]
    yield test, [values | one.changed(values, factor) for one, factor in changes]
    for one in (one for one in PARAMETERS if one.start is not None):
        field = next(iter(one.powers)).rpartition(".")[2].replace("_", "-")
        yield f"{test}-{field}", [one.changed(values, factor) for factor in FACTORS]


def measured(folder: Path, test: str) -> pd.DataFrame:
    """Rows of all runs of ``test`` in the order of :data:`PARAMETERS`; runs those that are missing."""
    folder.mkdir(parents=True, exist_ok=True)
    tables = []
    for name, points in sweeps_of(test):
        sweep = folder / f"{name}.yaml"
        sweep.write_text(yaml.safe_dump({"base": base_of(test), "points": points}, sort_keys=False))
        code = run(["batch", str(sweep), "--out", str(folder / name), "--workers", "1", "--threads", "1"])
        if code not in (0, 3):  # 3: rejected runs, whose numbers stand in brackets
            raise SystemExit(code)
        tables.append(pd.read_csv(folder / name / "results.csv").sort_values("run"))
    return pd.concat(tables, ignore_index=True)


@dataclass(frozen=True)
class Slope:
    """d ln(result) / d ln(parameter) by two runs, and whether one of them was rejected (``refused``)."""

    value: float
    refused: bool

    def __str__(self) -> str:
        if np.isnan(self.value):
            return "-"
        shown = f"{round(self.value, 2) + 0.0:+.2f}"  # no -0.00
        return f"({shown})" if self.refused else shown


def sensitivities(found: pd.DataFrame, result: str) -> tuple[list[Slope], float]:
    """Slope of each parameter, and what rounding makes of it.

    Runs that differ by rounding alone scatter by s in ln(result): two of them differ by sqrt(2) s, over ln(1.2 / 0.8).
    """
    logs, refused = np.log(found[result].to_numpy(float)), (found["status"] != "completed").to_numpy()
    start = 1 + len(ROUNDING)
    span = np.log(FACTORS[0] / FACTORS[1])
    values = (logs[start::2] - logs[start + 1 :: 2]) / span
    by_gate = refused[start::2] | refused[start + 1 :: 2]
    slopes = [Slope(*one) for one in zip(values.tolist(), by_gate.tolist(), strict=True)]
    return slopes, float(np.sqrt(2.0) * logs[:start].std(ddof=1) / span)


def main(folder: Path, tests: list[str]) -> None:
    """Run, then print the table, and write it where it is whole."""
    columns, notes = dict[str, list[str]](), []
    for test in tests or TESTS:
        found = measured(folder, test)
        for result, name in TESTS[test].results.items():
            slopes, noise = sensitivities(found, result)
            columns[name] = [f"{found[result].iloc[0]:.3g}", *map(str, slopes), f"{noise:.3f}"]
        notes.append(f"{test}: {len(found)} runs, {found['cpu_s'].sum() / 60.0:.1f} CPU minutes; {_refused(found)}.")
    rows = zip(["result", *(one.name for one in PARAMETERS), "sd by rounding"], *columns.values(), strict=True)
    text = "\n\n".join([table(["", *columns], [list(row) for row in rows]), "\n".join(f"- {note}" for note in notes)])
    print(text)
    if not tests:
        put("sensitivities", text, "identify.md")


def _refused(found: pd.DataFrame) -> str:
    """Words for the runs that were rejected or that have no result, and why."""
    lost = found[found["status"] != "completed"]
    if lost.empty:
        return "none was rejected"
    words = lost["status"].replace("refused", "rejected")
    reasons = [f"{_name(row)} {status} ({str(reason).partition(', ')[0]})" for row, status, reason in
               zip(lost.index, words, lost["reason"], strict=True)]  # fmt: skip
    return "; ".join(reasons)


def _name(row: int) -> str:
    """Words for the run in ``row``."""
    number = row - 1 - len(ROUNDING)
    if number < 0:
        return "unchanged"
    return f"{PARAMETERS[number // 2].name}, times {FACTORS[number % 2]:g}"


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:])
