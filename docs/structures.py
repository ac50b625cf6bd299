"""Shipped structures as docs/structures.md shows them: their cells, stretched along both directions. In a checkout:

python -m docs.structures            relaxes, stretches and draws all of them, and writes docs/structures.json
python -m docs.structures rib seed   those of these names
python -m docs.structures --draw     draws all of them again from the stored curves

``python -m docs.generate`` then writes the page from these numbers and from the fabric files.
"""

import json
import sys
import tempfile
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from docs.gallery import keep
from knittest.base.figure import BLUE, new_figure, save, style_axes
from knittest.base.files import structures
from knittest.config.fabric import Fabric
from knittest.config.loading import resolve
from knittest.config.structure import DIRECTIONS
from knittest.export.identity import git_commit
from knittest.export.summary import timestamp
from knittest.fabric.cell import CellSpec

HERE = Path(__file__).parent
STORE, PICTURES = HERE / "structures.json", HERE / "structures"
#: largest strain [%] along inlays; loops alone are stretched as far as the test does by itself
STRAIN = 1.5
#: points that are kept of a curve
POINTS = 25
Curve = list[tuple[float, float]]


@dataclass(frozen=True)
class StoredStructure:
    """Thickness [mm] and area mass [g/m2] of the relaxed cell of ``spec``; curves by direction, strain [%] and force
    per width [N/mm], and the reason why one is ``rejected`` by its quality checks.
    """

    thickness_mm: float
    area_mass_g_m2: float
    curves: dict[str, Curve]
    spec: dict[str, Any]
    commit: str | None
    date: str
    rejected: dict[str, str] = field(default_factory=dict)

    def is_stale(self, fabric: Fabric) -> bool:
        """Tell whether the cell of ``fabric`` has other inputs now."""
        return self.spec != spec_of(fabric)


def spec_of(fabric: Fabric) -> dict[str, Any]:
    """Inputs of the cell of ``fabric`` as JSON holds them."""
    found: dict[str, Any] = json.loads(json.dumps(asdict(CellSpec.of(fabric))))
    return found


def load() -> dict[str, StoredStructure]:
    """Stored structures by name."""
    if not STORE.exists():
        return {}
    return {name: StoredStructure(**one) for name, one in json.loads(STORE.read_text(encoding="utf-8")).items()}


def settings_of(fabric: Fabric, direction: str) -> dict[str, str | float]:
    """Fields of the cell test that stretches ``fabric`` along ``direction``."""
    strain = {"rig.max_strain": STRAIN} if fabric.inlays_along(direction) else {}
    return strain | {"rig.transverse": "held", "rig.at_fracture": "ends"}


def stretch(name: str, direction: str, folder: Path) -> tuple[Curve, str]:
    """Strain [%] and force per width [N/mm] of a cell that keeps its length across, and why it is rejected, if so."""
    import knittest

    run = knittest.cell(
        name, preset="quick", path=direction, set=settings_of(resolve(variant=name).fabric, direction),
        out=folder / f"{name}-{direction}", frames=False, pictures=False,
    )  # fmt: skip
    x, y = run.curve["strain_pct"].to_numpy(), run.curve[f"{direction}_n_per_mm"].to_numpy()
    kept = np.unique(np.linspace(0, len(x) - 1, POINTS).round().astype(int))
    return [(float(f"{x[k]:.4g}"), float(f"{y[k]:.4g}")) for k in kept], "; ".join(run.quality_checks.refused)


def store(name: str, folder: Path) -> None:
    """Relax and stretch the cell of a structure, and keep its numbers."""
    from knittest.fabric.relaxation import relaxed_cell
    from knittest.runs.preflight.yarn_counterparts import cell_mass

    fabric = resolve(variant=name).fabric
    cell = relaxed_cell(fabric)
    curves, reasons = {}, {}
    for direction in DIRECTIONS:
        curves[direction], reasons[direction] = stretch(name, direction, folder)
    found = StoredStructure(
        thickness_mm=cell.thickness,
        area_mass_g_m2=1e6 * cell_mass(fabric, cell) / float(np.prod(cell.spec.size)),
        curves=curves,
        spec=spec_of(fabric),
        commit=git_commit(),
        date=timestamp(),
        rejected={direction: reason for direction, reason in reasons.items() if reason},
    )
    stored = {key: asdict(one) for key, one in load().items()} | {name: asdict(found)}
    STORE.write_text(json.dumps(dict(sorted(stored.items())), indent=1) + "\n", encoding="utf-8")


def draw(name: str, folder: Path) -> None:
    """Draw the relaxed cell and the curves that passed their quality checks."""
    from knittest.export.yarn_pictures import cell_picture
    from knittest.fabric.relaxation import relaxed_cell

    PICTURES.mkdir(exist_ok=True)
    cell_picture(folder / f"{name}.png", relaxed_cell(resolve(variant=name).fabric), name)
    _draw_curves(folder / f"{name}-curves.png", load()[name])
    for picture in (f"{name}.png", f"{name}-curves.png"):
        keep(folder / picture, PICTURES / picture)


def _draw_curves(path: Path, stored: StoredStructure) -> None:
    figure = new_figure(8.0, 2.9)
    for axes, direction in zip(figure.subplots(1, 2), DIRECTIONS, strict=True):
        style_axes(axes)
        axes.set(xlabel="strain [%]", ylabel="force per width [N/mm]")
        axes.set_title(f"along the {direction}", loc="left", fontsize=10)
        if direction in stored.rejected:
            axes.text(0.5, 0.5, "rejected by its\nquality checks", ha="center", va="center", transform=axes.transAxes)
        else:
            axes.plot(*zip(*stored.curves[direction], strict=True), color=BLUE, linewidth=1.6)
            axes.set_ylim(bottom=min(0.0, *(force for _, force in stored.curves[direction])))
    figure.tight_layout()
    save(figure, path)


def main(arguments: list[str]) -> int:
    """Store and draw the structures that ``arguments`` name, or all; returns the exit code."""
    names = [one for one in arguments if one != "--draw"] or list(structures())
    if unknown := set(names) - set(structures()):
        print(f"{', '.join(sorted(unknown))}: no such structure; expected {', '.join(structures())}")
        return 2
    with tempfile.TemporaryDirectory() as place:
        for name in names:
            if "--draw" not in arguments:
                store(name, Path(place))
            draw(name, Path(place))
            print(name, flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
