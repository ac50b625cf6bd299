"""Writes docs/verification.md and docs/verification.png from the cases that the tests assert.

python benchmarks/verification.py. Takes every module of tests/verification/cases that has a function ``rows``; about
two minutes.
"""

import importlib
import re
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
from matplotlib import pyplot as plt

ROOT = Path(__file__).parents[1]
FOLDER = ROOT / "tests" / "verification"
sys.path[:0] = [str(FOLDER), str(ROOT / "tests" / "unit")]

from cases.row import Row  # noqa: E402

HEAD = """# Verification

This page compares the solver with closed-form solutions and published benchmarks. `python benchmarks/verification.py`
runs the cases and writes it; the tests assert its rows. Each case is a script in `tests/verification/cases`, whose
docstring has the closed form. Known errors of the models are in [limits.md](limits.md).

- *error*: result over reference minus 1; the result itself if the reference is zero. Several meshes: in their order.
- *order*: order of convergence over the last two of the meshes or time steps (dt) named.
- An empty case, source or mesh is that of the row above.

`benchmarks/breaks.py` breaks the physics on purpose and prints which tests notice.
`tests/verification/NOTICED.md` has these errors for shells and tools.

![Convergence: error against mesh width and against time step](verification.png)
"""


def collect() -> dict[str, list[Row]]:
    """Rows by the first line of their module's docstring."""
    found = {}
    for path in sorted(FOLDER.glob("cases/*.py")):
        module = importlib.import_module(f"cases.{path.stem}")
        if hasattr(module, "rows"):
            title = (module.__doc__ or path.stem).split("\n")[0]
            title = re.split("[,;] posed", title)[0].rstrip(".")
            found[title] = module.rows()
            print(f"{path.stem}: {len(found[title])} rows", file=sys.stderr)
    return found


#: cells of a line: case, source, quantity, reference, error, mesh, order
Cells = list[str]
QUANTITY, REFERENCE, ERROR, MESH, ORDER = range(2, 7)


def lines_of(rows: list[Row]) -> list[Cells]:
    """A line a quantity, with its errors on all meshes."""
    quantities: dict[tuple[str, ...], list[Row]] = {}
    for row in rows:
        key = (row.case, row.source or "-", row.quantity.removesuffix(" [-]"), f"{row.reference:.6g}")
        quantities.setdefault(key, []).append(row)
    return [
        [
            *key,
            "; ".join("0" if row.error == 0.0 else f"{row.error:.1e}" for row in same),
            "; ".join(re.sub(r"(?<=\d) x (?=\d)", "×", row.mesh) for row in same),
            "; ".join(f"{row.order:.2f}" for row in same if row.order is not None),
        ]
        for key, same in quantities.items()
    ]


def joined(lines: list[Cells]) -> list[Cells]:
    """Lines of one case and mesh whose quantities differ in one word, such as x and y, in one."""
    found: list[Cells] = []
    for line in lines:
        before = found[-1] if found else None
        words = before and _both(before, line)
        if before is None or not words:
            found.append(line)
            continue
        found[-1] = [
            *line[:QUANTITY], words, *(f"{before[k]}, {line[k]}" for k in (REFERENCE, ERROR)), line[MESH],
            ", ".join(text for text in (before[ORDER], line[ORDER]) if text),
        ]  # fmt: skip
    return found


def _both(before: Cells, line: Cells) -> str:
    """Quantity of both lines: "tip x, y [mm]" of "tip x [mm]" and "tip y [mm]"; empty if they do not go together."""
    old, new = re.split(r"(?<!,) ", before[QUANTITY]), line[QUANTITY].split(" ")
    other = [k for k, (a, b) in enumerate(zip(old, new, strict=False)) if a != b]
    alike = (*before[:QUANTITY], before[MESH], bool(before[ORDER])) == (*line[:QUANTITY], line[MESH], bool(line[ORDER]))
    if not alike or len(old) != len(new) or len(other) != 1 or ";" in line[ERROR]:
        return ""
    at = other[0]
    return " ".join([*old[:at], f"{old[at]}, {new[at]}", *old[at + 1 :]])


def table(title: str, lines: list[Cells]) -> str:
    """A section of the page; a column of orders where one has any, and no case, source and mesh that stands above."""
    columns = ["case (source)", "quantity", "reference", "error", "mesh", "order"]
    columns = columns if any(line[ORDER] for line in lines) else columns[:-1]
    texts = [f"\n## {title}\n", "| " + " | ".join(columns) + " |", "|" + "---|" * len(columns)]
    above = ["", "", ""]
    for case, source, quantity, reference, error, mesh, order in lines:
        cells = (case, f"({source})", mesh)
        new = ["" if text == old else text for text, old in zip(cells, above, strict=True)]
        above = list(cells)
        shown = [" ".join(text for text in new[:2] if text), quantity, reference, error, new[2], order]
        texts.append("| " + " | ".join(c.replace("|", r"\|") for c in shown[: len(columns)]) + " |")
    return "\n".join(texts)


def page(found: dict[str, list[Row]]) -> str:
    """Text of docs/verification.md, without the limits, which have a page of their own."""
    shown = {title: joined(lines_of(rows)) for title, rows in found.items() if "limits.md" not in title}
    return HEAD + "\n".join(table(title, lines) for title, lines in shown.items()) + "\n"


def plot(rows: list[Row], path: Path) -> None:
    """Errors of all series against mesh width and time step, with the slope of second order."""
    figure, panels = plt.subplots(1, 2, figsize=(11.0, 6.4), layout="constrained")
    for axes, title, chosen in zip(
        panels,
        ("mesh width over that of the coarsest [-]", "time step over the longest [-]"),
        ([r for r in rows if "dt" not in r.mesh], [r for r in rows if "dt" in r.mesh]),
        strict=True,
    ):
        first = {}
        for row in chosen:
            if row.series:
                first.setdefault(row.case, row)  # one quantity a case keeps the plot readable
        for k, (case, row) in enumerate(first.items()):
            width = [0.5**i for i in range(len(row.series))]
            axes.loglog(width, row.series, marker="osv^D"[k // 10 % 5], ms=4, lw=1, color=f"C{k % 10}", label=case)
        ends = [0.25, 1.0]
        axes.loglog(ends, [0.02 * w**2 for w in ends], color="black", lw=2, ls="--", label="order 2")
        axes.set_xlabel(title)
        axes.set_ylabel("error over reference [-]")
        axes.set_xticks([0.25, 0.5, 1.0], ["1/4", "1/2", "1"])
        axes.minorticks_off()
        axes.grid(alpha=0.3)
        axes.legend(fontsize=7, loc="upper center", bbox_to_anchor=(0.5, -0.12), ncols=3, frameon=False)
    figure.savefig(path, dpi=110)


def main() -> None:
    found = collect()
    plot([row for rows in found.values() for row in rows], ROOT / "docs" / "verification.png")
    (ROOT / "docs" / "verification.md").write_text(page(found), encoding="utf-8")


if __name__ == "__main__":
    main()
