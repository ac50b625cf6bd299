"""Markdown of docs/validation.md: from docs/runs.json, docs/cells.json, the paper's tables and the shipped fabrics."""

import math
from collections.abc import Iterator, Sequence

from docs import stored_cells, stored_runs
from docs.generate_config import table
from docs.stored_runs import StoredRun
from docs.validation_fabric import cell_rows, shear_rows
from docs.validation_order import order_section
from docs.validation_rows import LIMIT_INPUT, LIMIT_SD, Row, fitted, rows_of
from docs.validation_sets import sets_section

PRESETS = ("paper", "standard", "quick")
#: tests and scales with rows
TESTS = (
    ("tensile", "meso"), ("tensile", "macro"), ("cantilever", "macro"), ("cantilever", "meso"),
    ("friction", "macro"), ("friction", "meso"),
)  # fmt: skip
INTRO = f"""
# Validation

The model beside the experiment: Tables 2 and 3 and Eq. 3 of Pham et al. (2019), mean and standard deviation of the
specimens. What fails stands here too. `python -m docs.generate` writes this page from stored runs; nothing is
typed, and a test fails when a run was given other numbers than its command gives now.

Every row is judged by a rule that was set before: a row that is `predicted`, or `tuned` on the experiment, passes
within {LIMIT_SD:g} standard deviation of the experiment; an `input`, which the model was given and returns, within
{100.0 * LIMIT_INPUT:g} %. That is a wide rule: the mean of 9 to 16 strips is known three to four times better. A
number is `tuned` also where a parameter was chosen with it in view. Only end points are measured: no shape of a
curve is validated.

*±* is the numerical error ([--verify](reference-cli.md): half the speed and another mesh) of the row itself, or,
where it says so, the share found at a smaller preset; where it says "not estimated", nothing is known of it
([what has none](#what-has-no-numerical-error)). "within
± open" marks a verdict that it could turn. *Copy* is
the trivial predictor: another measured row of the same yarns, variant 1 warp (for that row itself: weft), a force
in proportion to the yarns' density. A model that is further off than the copy adds nothing to that row.
""".strip()
SINGLE = """
**Single** runs give the yarns quantiles of their scatter, and the calibration was done on them; **ensembles** draw
eight specimens of `standard`, their mean and, in brackets, their standard deviation; the mean is known to a third of
that. Both are judged. A strip of yarns has whole ones only: where they are not those of its width, the run says so, and
its force is off by that too (an ensemble alternates).
""".strip()
BENT = """
The overhang at which a strip meets the plane. Bending stiffness was derived from it by Eq. 2, of yarns' warps then
tuned on it: it verifies the bending model. It stands when the chord is within 0.05 deg (shells) or 0.25 deg (yarns:
0.35 % of the overhang) of the plane, and the measured one is tried first; so read 0.0 % as less than that.
""".strip()
CELL = """
Mass: lengths of the yarns of the relaxed cell times their linear densities, as `knittest check` counts it. Thickness:
the outermost surfaces of that cell; the one of variant 1 was used to choose the crimp and the knitting yarn's diameter,
which variant 2 took over. ± is that of the yarns' nodes: the same cell with half as many again, by the same rule as
--verify; at rest there is no speed.
""".strip()
SHEAR = """
The paper shears both variants and says in words that variant 2 needs clearly less force; it prints none. The rule:
variant 2 below variant 1 at every angle. Frames of yarns of 100 mm, friction 0.3 (assumed), work-conjugate force
over the area (`data/pham2019/curves/shear-v1-simulated.csv`, `shear-v2-simulated.csv`). The copy is the same force
for both.
""".strip()

UNKNOWN = """
Nothing is known of the numerical error of these numbers. A verdict on them is that of the number as it is.
""".strip()


def validation_page() -> str:
    """The whole page."""
    runs = stored_runs.load()
    parts = [INTRO, "## Summary", _summary(runs), "## Tension of yarns", SINGLE, *_tension(runs)]
    parts += ["## Tension of shells", _plain(rows_of(runs, "tensile", "macro"))]
    bent = [*rows_of(runs, "cantilever", "macro"), *rows_of(runs, "cantilever", "meso")]
    parts += ["## Bending", BENT, _plain(bent)]
    parts += ["## Friction", _plain([*rows_of(runs, "friction", "macro"), *rows_of(runs, "friction", "meso")])]
    parts += ["## Mass and thickness of the yarns' model", CELL, table(*_cells())]
    parts += ["## Shear: variant 2 below variant 1", SHEAR, table(*shear_rows()), *order_section()]
    parts += sets_section()
    parts += ["## What has no numerical error", UNKNOWN, _unknown(runs)]
    parts += ["## Runs behind this page", table(*_runs(runs))]
    return "\n\n".join(parts) + "\n"


def _cells() -> tuple[Sequence[str], Sequence[Sequence[str]]]:
    return cell_rows(stored_cells.load())


def _summary(runs: Sequence[StoredRun]) -> str:
    """Count the rows that pass, by kind, and those in which the model is nearer than the copy."""
    rows = [row for test in TESTS for row in rows_of(runs, *test)]
    verdicts = [(row.kind, row.verdict) for row in rows]
    verdicts += [(cells[-2], cells[-1]) for cells in _cells()[1]] + [("predicted", c[-1]) for c in shear_rows()[1]]
    lines = [
        f"- `{kind}`: {sum('passed' in verdict for k, verdict in verdicts if k == kind)} of "
        f"{sum(k == kind for k, _ in verdicts)} rows pass."
        for kind in ("predicted", "tuned", "input")
    ]
    lines += _against_copies(rows)
    failed = sorted(set(_failures(rows)))
    return "\n".join([*lines, "- What fails: " + ("; ".join(failed) if failed else "nothing") + "."])


def _unknown(runs: Sequence[StoredRun]) -> str:
    """Rows whose numerical error nobody estimated, by test and scale, and what it would take."""
    lines = []
    for test, scale in TESTS:
        rows = rows_of(runs, test, scale)
        open_rows = [row for row in rows if not math.isfinite(row.error)]
        if not open_rows:
            continue
        costs = sorted(row.run.cost["cpu_s"] for row in open_rows)
        of = "yarns" if scale == "meso" else "shells"
        took = " to ".join(dict.fromkeys((f"{costs[0]:.0f}", f"{costs[-1]:.0f}")))
        lines.append(
            f"- {test} of {of}: {len(open_rows)} of {len(rows)} rows. `--verify` runs each again twice, once at half "
            f"the speed or step and once on another mesh; the runs themselves took {took} s of processor time."
        )
    lines.append(
        "- force of variant 2 over that of variant 1 in shear: all angles. The stored law of each variant is one frame "
        "of yarns, run once; `knittest picture-frame --scale meso --verify` gives the ± of a frame, and that of the "
        "ratio is the sum of both shares."
    )
    return "\n".join(lines)


def _against_copies(rows: Sequence[Row]) -> Iterator[str]:
    """Count the rows in which calibrated yarns, single at the paper's size or ensembles, are nearer than a copy."""
    for name, chosen in (("single runs of `paper`", ("paper", 1)), ("ensembles", ("standard", 8))):
        judged = [
            (abs(row.deviation), abs(row.copy.deviation(row.measured))) for row in rows
            if row.copy and row.run.options["scale"] == "meso" and row.run.options["parameters"] == "calibrated"
            and (row.run.options["preset"], row.run.specimens) == chosen and not fitted(row)
        ]  # fmt: skip
        yield (
            f"- Of the {len(judged)} tensile rows that no number of the calibrated yarns was fitted to, the model "
            f"({name}) is nearer to the experiment than the copy in {sum(own < copy for own, copy in judged)}."
        )


def _failures(rows: Sequence[Row]) -> Iterator[str]:
    for row in rows:
        if "passed" not in row.verdict and row.verdict != "not judged":
            o = row.run.options
            yield (
                f"{o['test']} {o['scale']} V{o['variant']} {o['direction']} {row.quantity} ({o['parameters']}, "
                f"{_how(row)}) {100.0 * row.deviation:+.1f} %"
            )
    for cells in _cells()[1]:
        if "FAILED" in cells[-1]:
            yield f"V{cells[0]} {cells[1]} {cells[5]}"
    for cells in shear_rows()[1]:
        if "FAILED" in cells[-1]:
            yield f"force of V2 over that of V1 at {cells[0]} deg {cells[3]}"


def _tension(runs: Sequence[StoredRun]) -> Iterator[str]:
    rows = rows_of(runs, "tensile", "meso")
    for parameters, note in (
        ("calibrated", "Parameters `calibrated`:"),
        (
            "as-measured",
            "Parameters `as-measured`, nothing fitted to a strip (the load area was chosen with the forces in view):",
        ),
    ):
        chosen = [row for row in rows if row.run.options["parameters"] == parameters]
        if chosen:
            yield note
            yield table(*_tensile_table(chosen))


def _tensile_table(rows: Sequence[Row]) -> tuple[Sequence[str], list[list[str]]]:
    head = (
        "variant",
        "along",
        "quantity",
        "measured",
        "run",
        "simulated ±",
        "deviation",
        "in sd",
        "copy",
        "its deviation",
        "kind",
        "verdict",
    )
    lines = []
    for row in rows:
        assert row.copy
        off = 100.0 * row.copy.deviation(row.measured)
        lines.append(
            [*_named(row), _how(row), _value(row), f"{100.0 * row.deviation:+.1f} %", f"{row.deviation_sd:+.2f}",
             f"{row.copy.value:.4g} ({row.copy.of})", f"{off:+.1f} %", row.kind, row.verdict]
        )  # fmt: skip
    return head, lines


def _plain(rows: Sequence[Row]) -> str:
    head = (
        "scale",
        "variant",
        "along",
        "quantity",
        "measured",
        "run",
        "simulated ±",
        "deviation",
        "in sd",
        "kind",
        "verdict",
    )
    lines = [
        [row.run.options["scale"], *_named(row), _how(row), _value(row), f"{100.0 * row.deviation:+.1f} %",
         f"{row.deviation_sd:+.2f}", row.kind, row.verdict]
        for row in rows
    ]  # fmt: skip
    return table(head, lines) if lines else "No run is stored."


def _named(row: Row) -> list[str]:
    o = row.run.options
    spread = f" ± {row.measured.sd:g}" if row.measured.sd > 0.0 else ""
    return [o["variant"], o["direction"] or "", row.quantity, f"{row.measured.mean:g}{spread}"]


def _how(row: Row) -> str:
    run = row.run
    how = run.options["preset"] + (f", mean of {run.specimens}" if run.specimens > 1 else ", single")
    return ", ".join(filter(None, (how, row.measured.scaled)))


def _value(row: Row) -> str:
    spread = f" (sd {row.sd:.3g})" if math.isfinite(row.sd) else ""
    if not math.isfinite(row.error):
        return f"{row.value:.4g}{spread}, ± not estimated"
    own = row.error_of == row.run.options["preset"] and row.run.specimens == 1
    return f"{row.value:.4g}{spread} ± {float(f'{row.error:.2g}'):g}" + ("" if own else f" (found at `{row.error_of}`)")


def _runs(runs: Sequence[StoredRun]) -> tuple[Sequence[str], list[list[str]]]:
    """Cost and quality of each, with its command."""
    head = ("command", "elements", "steps", "CPU [s]", "KE/work [%]", "energy error [%]", "commit", "date")
    lines = []
    for run in sorted(
        runs, key=lambda r: (r.options["test"], r.options["scale"], PRESETS.index(r.options["preset"]), r.command)
    ):
        q, k = run.quality, run.cost
        lines.append(
            [f"`{run.command}`", f"{k['elements']}", f"{k['steps']}", f"{k['cpu_s']:.0f}",
             f"{100.0 * q['ke_over_ie_max']:.2f}", f"{100.0 * q['energy_error_max']:.3f}", run.commit[:8],
             run.date[:10]]
        )  # fmt: skip
    return head, lines


def _order(run: StoredRun) -> tuple[str, str, int, str]:
    return run.options["test"], run.options["scale"], PRESETS.index(run.options["preset"]), run.command
