"""Makes up the laboratory files of docs/own-fabric.md: nobody measured them.

python benchmarks/made_up_fabric.py [FOLDER]    FOLDER: data/tutorial of this checkout if not given
"""

import sys
from pathlib import Path

import numpy as np

SEED = 20190812
#: share of the strain at the peak in which the curve is a parabola: the yarns' waves straighten
TOE = 0.5
#: specimens, width and gauge length [mm], mean and sd of the largest force [N] and of the strain there [%]
STRIPS = {
    "warp": (5, 50.0, 200.0, (6900.0, 280.0), (1.65, 0.10)),
    "weft": (5, 50.0, 200.0, (5600.0, 260.0), (1.60, 0.11)),
}
#: specimens, gauge length [mm], mean and sd of the largest force [N] and of the strain there [%]
YARNS = (6, 250.0, (477.0, 45.0), (1.05, 0.11))


def main() -> None:
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parents[1] / "data/tutorial"
    for name, text in files().items():
        (folder / name).write_text(text, encoding="utf-8")


def files() -> dict[str, str]:
    """Text of each file by its name."""
    rng = np.random.default_rng(SEED)
    found = {}
    for direction, (count, width, gauge, force, strain) in STRIPS.items():
        for k, (peak, at) in enumerate(drawn(rng, count, force, strain), 1):
            write = german if direction == "warp" else english
            found[f"{direction}-{k}.csv"] = write(f"strip {direction} {k}", width, gauge, *strip(rng, peak, at))
    count, gauge, force, strain = YARNS
    for k, (peak, at) in enumerate(drawn(rng, count, force, strain), 1):
        found[f"yarn-{k}.csv"] = english(f"inlay yarn {k}", None, gauge, *yarn(rng, peak, at))
    return found


def drawn(rng: np.random.Generator, count: int, force: tuple, strain: tuple) -> np.ndarray:
    """Largest force [N] and strain there [%] of each specimen (n, 2), of just these means and sds."""
    found = rng.standard_normal((count, 2))
    found = (found - found.mean(axis=0)) / found.std(axis=0, ddof=1)
    return found * (force[1], strain[1]) + (force[0], strain[0])


def strip(rng: np.random.Generator, peak: float, at: float) -> tuple[np.ndarray, np.ndarray]:
    """Strain [%] and force [N] of a strip: toe, line, and yarns that break one after another."""
    x = np.linspace(0.0, 1.0, 34)
    rising = np.where(x < TOE, x**2 / (2.0 * TOE), x - TOE / 2.0) / (1.0 - TOE / 2.0)
    falling = np.array([0.93, 0.81, 0.55, 0.31, 0.12])
    strain = np.concatenate([x, 1.0 + 0.03 * np.arange(1, 6)]) * at
    return strain, noisy(rng, np.concatenate([rising, falling]) * peak, peak)


def yarn(rng: np.random.Generator, peak: float, at: float) -> tuple[np.ndarray, np.ndarray]:
    """Strain [%] and force [N] of a yarn: a line, and the break."""
    x = np.linspace(0.0, 1.0, 22)
    return np.append(x, 1.01) * at, noisy(rng, np.append(x, 0.05) * peak, peak)


def noisy(rng: np.random.Generator, force: np.ndarray, peak: float) -> np.ndarray:
    """``force`` as a cell of 0.1 % would show it; its largest stays where it is."""
    shown = force + np.where(force == force.max(), 0.0, rng.normal(0.0, 0.001 * peak, len(force)))
    return np.clip(shown, 0.0, peak)


def german(name: str, width: float, gauge: float, strain: np.ndarray, force: np.ndarray) -> str:
    """Travel and force as a German machine writes them."""
    sizes = [f"Probenbreite;{width:.1f};mm", f"Einspannlänge;{gauge:.1f};mm"]
    rows = [f"{e * gauge / 100.0:.4f};{f / 1000.0:.5f}" for e, f in zip(strain, force, strict=True)]
    sizes, rows = ([line.replace(".", ",") for line in lines] for lines in (sizes, rows))
    return "\n".join([f"Probe;{name} (made up)", *sizes, "", "Weg;Kraft", "mm;kN", *rows]) + "\n"


def english(name: str, width: float | None, gauge: float, strain: np.ndarray, force: np.ndarray) -> str:
    """Strain and force with points and commas; of a yarn without a width."""
    sizes = [] if width is None else [f"strip width [mm],{width:.0f}"]
    head = [f"specimen,{name} (made up)", *sizes, f"gauge length [mm],{gauge:.0f}", "", "strain [%],force [N]"]
    return "\n".join([*head, *(f"{e:.5f},{f:.2f}" for e, f in zip(strain, force, strict=True))]) + "\n"


if __name__ == "__main__":
    main()
