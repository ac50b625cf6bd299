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

This page compares the model with the experiment: Tables 2 and 3 and Eq. 3 of Pham et al. (2019), mean and standard
deviation (sd) of the specimens. It lists failures too. `python -m docs.generate` writes it from stored runs; a test
fails if the command of a stored run now has other inputs.

The rules were set before the comparison. A row passes up to this deviation:

- `predicted` and `tuned`: {LIMIT_SD:g} sd of the experiment. This is wide: the mean of 9 to 16 strips is known three
  to four times better. A row is also `tuned` if a parameter was chosen with it in view.
- `input` (given to the model, which returns it): {100.0 * LIMIT_INPUT:g} %.

Only single values are measured, so no curve shape is validated.

- *±* is the numerical error ([--verify](reference-cli.md): half the speed, another mesh). "found at" names the preset
  whose relative error was used; "not estimated" means [unknown](#what-has-no-numerical-error). With "within ± open"
  the error could change the verdict.
- *baseline* is a prediction without a model: another measured row of the same yarns (V1 warp; for V1 warp itself V1
  weft), forces scaled by yarn density. A model that is further off adds nothing.
""".strip()
SINGLE = """
- **Single**: the yarns have the quantiles of their distributions. The set was calibrated on single runs.
- **Mean of 8**: an ensemble of eight random specimens of `standard`, with its sd in brackets. The mean is known to a
  third of this sd.
- The model has whole yarns. If the real strip has a fraction of a yarn, the force is scaled as *run* states.
""".strip()
BENT = """
The row is the overhang at which the chord reaches the plane of the tester. The bending stiffness was derived from the
measured overhang by Eq. 2, and that of the meso warp was tuned on it. So agreement verifies the bending model only.
The search tries the measured overhang first and accepts a chord within 0.05 deg (macro) or 0.25 deg (meso: 0.35 % of
the overhang). So 0.0 % means less than this tolerance.
""".strip()
CELL = """
- Mass: yarn lengths of the relaxed cell times linear densities, as in `knittest check`. Baseline: mass of the other
  variant, scaled by the length of inlays.
- Thickness: between the outermost yarn surfaces of that cell. The thickness of variant 1 was used to choose the crimp
  and the knitting yarn diameter, also for variant 2. Baseline: the other variant.
- ±: from the same cell with half as many nodes again, by the rule of `--verify` (without speed).
""".strip()
SHEAR = """
The paper prints no shear force, but states that variant 2 needs clearly less than variant 1. The rule: variant 2 below
variant 1 at every angle. The forces are those of meso frames of 100 mm with friction 0.3 (assumed), work-conjugate and
per area (`data/pham2019/curves/shear-v1-simulated.csv`, `shear-v2-simulated.csv`). The baseline is the same force for
both.
""".strip()

UNKNOWN = """
The numerical error of these values was not estimated; their verdicts ignore it.
""".strip()


def validation_page() -> str:
    """The whole page."""
    runs = stored_runs.load()
    parts = [INTRO, "## Summary", _summary(runs), "## Tensile test, meso", SINGLE, *_tension(runs)]
    parts += ["## Tensile test, macro", _plain(rows_of(runs, "tensile", "macro"))]
    bent = [*rows_of(runs, "cantilever", "macro"), *rows_of(runs, "cantilever", "meso")]
    parts += ["## Bending", BENT, _plain(bent)]
    parts += ["## Friction", _plain([*rows_of(runs, "friction", "macro"), *rows_of(runs, "friction", "meso")])]
    parts += ["## Mass and thickness of the meso model", CELL, table(*_cells())]
    parts += ["## Shear: order of the variants", SHEAR, table(*shear_rows()), *order_section()]
    parts += sets_section()
    parts += ['<a id="what-has-no-numerical-error"></a>', "## Values without numerical error", UNKNOWN, _unknown(runs)]
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
    return "\n".join([*lines, f"- Failed: {len(failed)}.", *(f"    - {one}" for one in failed)])


def _unknown(runs: Sequence[StoredRun]) -> str:
    """Rows whose numerical error nobody estimated, by test and scale, and what it would take."""
    lines = []
    for test, scale in TESTS:
        rows = rows_of(runs, test, scale)
        open_rows = [row for row in rows if not math.isfinite(row.error)]
        if not open_rows:
            continue
        costs = sorted(row.run.cost["cpu_s"] for row in open_rows)
        took = " to ".join(dict.fromkeys((f"{costs[0]:.0f}", f"{costs[-1]:.0f}")))
        lines.append(
            f"- {test}, {scale}: {len(open_rows)} of {len(rows)} rows. `--verify` would repeat each run twice, at half "
            f"the speed or step and on another mesh. The runs took {took} s of CPU time."
        )
    lines.append(
        "- force of variant 2 over that of variant 1 in shear: all angles. Each law is from one run of a meso frame. "
        "`knittest picture-frame --scale meso --verify` gives the ± of a frame; that of the ratio is the sum of both "
        "relative errors."
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
            f"- Tensile rows that no parameter of `calibrated` was fitted to, {name}: the model is nearer to the "
            f"experiment than the baseline in {sum(own < copy for own, copy in judged)} of {len(judged)}."
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
            "Parameters `as-measured`: nothing was fitted to strips; the fibre area was chosen with forces in view.",
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
        "baseline",
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
