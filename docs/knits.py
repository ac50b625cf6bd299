"""Acrylic knits of Singal et al. (2024): curves of cells and specimens beside the measured ones. In a checkout:

python -m docs.knits               runs all, some two hours on one core, and writes docs/knits.json
python -m docs.knits jersey rib    those of these names; --specimens or --cells only, --missing only what is not stored
python -m docs.knits --authors     only the jersey that the authors simulated

``python -m docs.generate`` then writes the page docs/acrylic-knits.md. Cells are free to contract, or keep their width;
specimens have the measured width and length, and are shells with the law of two strains of their cell.
"""

import csv
import json
import sys
import tempfile
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from docs.gallery import keep
from knittest.base.figure import BLUE, GREY, RED, new_figure, save, style_axes
from knittest.base.files import data_dir
from knittest.config.loading import resolve
from knittest.config.structure import DIRECTIONS
from knittest.export.identity import git_commit
from knittest.export.summary import timestamp
from knittest.laboratory.base import biaxial_table
from knittest.materials.laminate import fit_table

HERE = Path(__file__).parent
STORE, PICTURES = HERE / "knits.json", HERE / "knits"
KNITS = ("jersey", "garter", "rib", "seed")
#: largest strain [%] of cells free to contract, which end at :data:`FORCE`, by fabric and direction; else :data:`MOST`
STRAINS, MOST = (
    {("rib", "weft"): 230.0, ("garter", "warp"): 160.0, ("seed", "weft"): 160.0, ("seed", "warp"): 160.0},
    90.0,
)
#: the same of cells of constant width and of specimens, over the largest measured strain
HELD = 1.2
#: force per width [N/mm] at which cells and specimens end, and forces at which curves are compared
FORCE, COMPARED_AT = 0.22, (0.05, 0.1, 0.15, 0.2)
#: deviation of the force at equal strain [-], or of the strain in standard deviations, up to which a point agrees
DEVIATION, DEVIATIONS = 0.15, 2.0
#: core [mm] of the jersey whose simulated curves the authors publish
AUTHORS_CORE = 0.60
#: models of a curve: cell free to contract, cell of constant width, specimen between clamps
MODELS = ("free", "held", "specimen")


class Measured(NamedTuple):
    """Size [mm] of the specimen; force per width [N/mm], strain and its standard deviation, transverse strain [-]."""

    width: float
    length: float
    force: np.ndarray
    strain: np.ndarray
    deviation: np.ndarray
    transverse: np.ndarray


def measured(knit: str, direction: str) -> Measured:
    """Curve of ``knit`` along ``direction``, the mean of four repeats."""
    name = f"Acrylic Yarn {'Stockinette' if knit == 'jersey' else knit.title()} {'X' if direction == 'weft' else 'Y'}"
    with (data_dir() / "singal2024" / "tension.csv").open(encoding="utf-8") as text:
        rows = [row for row in csv.DictReader(text) if row["sample"] == name and row["axial_strain_mean"]]
    columns = ("stress_N_per_mm", "axial_strain_mean", "axial_strain_sd", "transverse_strain_mean")
    values = np.array([[float(row[column] or "nan") for column in columns] for row in rows])
    return Measured(float(rows[0]["width_mm"]), float(rows[0]["clamp_mm"]), *values.T)


def simulated_by_authors(direction: str) -> tuple[np.ndarray, np.ndarray]:
    """Strain [-] and force per width [N/mm] of the authors' own jersey with a core of :data:`AUTHORS_CORE`."""
    with (data_dir() / "singal2024" / "simulated_jersey.csv").open(encoding="utf-8") as text:
        rows = [row for row in csv.DictReader(text) if row["direction"] == direction]
    strain, force = np.array([[float(row["strain"]), float(row["stress_N_per_mm"])] for row in rows]).T
    return strain, force


def load() -> dict[str, Any]:
    """Stored curves by knit, direction and model."""
    return json.loads(STORE.read_text(encoding="utf-8")) if STORE.exists() else {}


def run_cell(knit: str, direction: str, transverse: str, folder: Path, core: float | None = None) -> dict[str, Any]:
    """Curve of the cell: strain [-], force per width [N/mm], transverse strain [-]; ``core`` [mm] replaces that of
    the fabric.
    """
    import knittest

    most = STRAINS.get((knit, direction), MOST)
    if transverse == "held":
        most = round(100.0 * HELD * float(measured(knit, direction).strain.max()), 1)
    # the force across ends a cell of constant width too
    force = FORCE if transverse == "free" else 2.0 * FORCE
    settings = {"rig.max_strain": most, "rig.max_force": force, "rig.transverse": transverse}
    if core is not None:
        settings["fabric.knitting.beam_diameter"] = core
    run = knittest.cell(
        f"acrylic-{knit}", preset="quick", path=direction, set=settings, out=folder / f"{direction}-{transverse}",
        frames=False, pictures=False,
    )  # fmt: skip
    across = "warp" if direction == "weft" else "weft"
    record = np.genfromtxt(run.folder / "contacts.csv", delimiter=",", names=True)
    return _curve(
        run.curve["strain_pct"], run.curve[f"{direction}_n_per_mm"], record[f"{across}_strain_pct"],
        "; ".join(run.quality_checks.refused),
    )  # fmt: skip


def run_specimen(knit: str, direction: str, folder: Path) -> dict[str, Any]:
    """Curve of the specimen between clamps: shells with the law of two strains of the cell."""
    import knittest

    size = measured(knit, direction)
    most = round(100.0 * HELD * float(size.strain.max()), 1)
    settings = {
        "rig.width": size.width, "rig.gauge_length": size.length, "rig.max_force": FORCE, "rig.max_strain": most,
    }  # fmt: skip
    run = knittest.tensile(
        f"acrylic-{knit}", scale="macro", direction=direction, set=settings, out=folder / f"{direction}-strip",
        frames=False, pictures=False,
    )  # fmt: skip
    force = run.curve["force_n"] / size.width
    contraction = float(run.results["contraction_pct"]) if "contraction_pct" in run.results else float("nan")
    found = _curve(run.curve["strain_pct"], force, np.full(len(force), np.nan), "; ".join(run.quality_checks.refused))
    fabric = resolve(config=run.folder / "config.yaml").fabric
    fit = fit_table(fabric, biaxial_table(fabric))
    free = [[float(f"{v:.4g}") for v in row] for row in np.column_stack(fit.strip_curve(DIRECTIONS.index(direction)))]
    law = {"law": fabric.macro.biaxial.ref, "law_free": free}
    return found | {"contraction": round(0.01 * contraction, 4)} | law


def _curve(strain: Any, force: Any, transverse: Any, rejected: str) -> dict[str, Any]:
    """Rows (strain [-], force, transverse strain [-]) up to the largest force, at most 80 of them."""
    rows = np.column_stack([0.01 * np.asarray(strain), np.asarray(force), 0.01 * np.asarray(transverse)])
    rows = np.vstack([np.zeros(3), rows[: int(np.argmax(rows[:, 1])) + 1]])
    kept = np.unique(np.linspace(0, len(rows) - 1, 80).round().astype(int))
    points = [[None if np.isnan(v) else float(f"{v:.4g}") for v in row] for row in rows[kept]]
    return {"points": points, "rejected": rejected, "commit": git_commit(), "date": timestamp()}


class Deviation(NamedTuple):
    """At a measured ``force``: measured and simulated strain, deviation of the force at equal strain [-], agreement."""

    force: float
    strain: float
    simulated: float
    of_force: float
    agrees: bool


def deviations(found: Measured, curve: dict[str, Any]) -> list[Deviation]:
    """Compare a stored curve with the measured one at :data:`COMPARED_AT` forces; nothing is extrapolated."""
    points = np.array([[row[0], row[1]] for row in curve["points"]])
    strain, force = points[:, 0], np.maximum.accumulate(points[:, 1])
    rows = []
    for at in COMPARED_AT:
        k = int(np.argmin(np.abs(found.force - at)))
        wanted, spread = float(found.strain[k]), float(found.deviation[k])
        simulated = float(np.interp(at, force, strain, right=np.nan))
        over = float(np.interp(wanted, strain, force, right=np.nan)) / at - 1.0
        agrees = abs(over) <= DEVIATION or abs(simulated - wanted) <= DEVIATIONS * spread
        rows.append(Deviation(at, wanted, simulated, over, bool(agrees)))
    return rows


#: force per width [N/mm] at which strains of directions and fabrics, and transverse strains, are compared
ORDER_AT, TRANSVERSE_AT = 0.1, (0.1, 0.2)


def strain_at(curve: dict[str, Any], force: float, column: int = 0) -> float:
    """Strain [-] of a stored curve at ``force`` per width, or another ``column`` of it; nan beyond its end."""
    points = np.array([[np.nan if value is None else value for value in row] for row in curve["points"]])
    rising = np.maximum.accumulate(points[:, 1])
    return float(np.interp(force, rising, points[:, column], right=np.nan))


def measured_at(found: Measured, force: float) -> int:
    """Row of the measured curve nearest to ``force`` per width."""
    return int(np.argmin(np.abs(found.force - force)))


def bracket(found: Measured, curves: dict[str, Any], force: float) -> str:
    """Say where the measured strain lies at ``force``: between the cells of constant width and free to contract."""
    if not {"free", "held"} <= set(curves):
        return "-"
    strain = float(found.strain[measured_at(found, force)])
    held, free = (strain_at(curves[name], force) for name in ("held", "free"))
    if np.isnan(held) or np.isnan(free):
        return "-"
    if strain < held:
        return "stiffer than both"
    return "softer than both" if strain > free else f"between, {100.0 * (strain - held) / (free - held):.0f} % free"


def draw(knit: str, stored: dict[str, Any]) -> None:
    """Draw the curves of both directions beside the measured ones."""
    figure = new_figure(8.0, 3.0)
    styles = {"free": (BLUE, "-"), "held": (BLUE, ":"), "specimen": (RED, "-")}
    for axes, direction in zip(figure.subplots(1, 2), ("weft", "warp"), strict=True):
        style_axes(axes)
        found = measured(knit, direction)
        axes.fill_betweenx(
            found.force, found.strain - 2.0 * found.deviation, found.strain + 2.0 * found.deviation, color=GREY,
            alpha=0.3, linewidth=0.0,
        )  # fmt: skip
        axes.plot(found.strain, found.force, "o", color="black", markersize=3, label="measured, 2 sd")
        for model, curve in stored.get(direction, {}).items():
            points = np.array([[row[0], row[1]] for row in curve["points"]])
            colour, line = styles[model]
            axes.plot(*points.T, line, color=colour, linewidth=1.5, label=LABELS[model])
        axes.set(xlabel="strain [-]", ylabel="force per width [N/mm]", ylim=(0.0, 0.22))
        axes.set_xlim(0.0, 1.25 * float(found.strain[found.force <= 0.2].max()))
        axes.set_title(f"{knit}, along the {direction}", loc="left", fontsize=10)
    axes.legend(fontsize=7, frameon=False)
    figure.tight_layout()
    PICTURES.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as place:
        save(figure, Path(place) / f"{knit}.png")
        keep(Path(place) / f"{knit}.png", PICTURES / f"{knit}.png")


LABELS = {"free": "cell, free to contract", "held": "cell, constant width", "specimen": "specimen between clamps"}


def _is_skipped(arguments: list[str], model: str, stored: dict[str, Any] | None) -> bool:
    """Tell whether the options leave out ``model``, whose curve is ``stored`` unless None."""
    other = "--cells" if model == "specimen" else "--specimens"
    return "--draw" in arguments or other in arguments or ("--missing" in arguments and stored is not None)


def write_store(stored: dict[str, Any]) -> None:
    """Write the stored curves."""
    STORE.write_text(json.dumps(stored, indent=1) + "\n", encoding="utf-8")


def main(arguments: list[str]) -> int:
    """Run the knits that ``arguments`` name, or all; returns the exit code."""
    names = [one for one in arguments if not one.startswith("--")] or list(KNITS)
    if unknown := set(names) - set(KNITS):
        print(f"{', '.join(sorted(unknown))}: no such knit; expected {', '.join(KNITS)}")
        return 2
    if "--authors" in arguments or not arguments:
        with tempfile.TemporaryDirectory() as place:
            runs = {d: run_cell("jersey", d, "free", Path(place), AUTHORS_CORE) for d in DIRECTIONS}
        write_store(load() | {"authors": runs})
    if arguments == ["--authors"]:
        return 0
    for knit in names:
        for direction in DIRECTIONS:
            for model in MODELS:
                if _is_skipped(arguments, model, load().get(knit, {}).get(direction, {}).get(model)):
                    continue
                with tempfile.TemporaryDirectory() as place:
                    run = (
                        run_specimen(knit, direction, Path(place)) if model == "specimen"
                        else run_cell(knit, direction, model, Path(place))
                    )  # fmt: skip
                stored = load()
                stored.setdefault(knit, {}).setdefault(direction, {})[model] = run
                write_store(stored)
                print(knit, direction, model, flush=True)
        draw(knit, load().get(knit, {}))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
