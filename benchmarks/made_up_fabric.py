"""Makes up the laboratory files of docs/own-fabric.md: nobody measured them.

python benchmarks/made_up_fabric.py [FOLDER]    FOLDER: data/tutorial of this checkout if not given
"""

import sys
from pathlib import Path

import numpy as np

from knittest.materials.trellis import crosshead, crosshead_of_normalised

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
#: specimens, side of frame and fabric [mm], end [deg], mean and sd of the normalised shear force at 40 deg [N/mm]
FRAMES = (3, 200.0, 180.0, 44.0, (0.08, 0.006))
#: strips, area mass [g/m2], mean and sd of the overhang [mm]
OVERHANGS = {"warp": (5, 830.0, (165.0, 5.0)), "weft": (5, 830.0, (150.0, 4.0))}
#: strips, normal force [N], plates [mm], travel [mm], mean and sd of the kinetic force [N]
FRICTION = (3, 2000.0, (150.0, 50.0), 20.0, (290.0, 12.0))


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
    return found | frames(rng) | overhangs(rng) | frictions(rng)


def frames(rng: np.random.Generator) -> dict[str, str]:
    """Crosshead force over displacement of a picture frame, there and a way back."""
    count, frame, fabric, end, at_40 = FRAMES
    found = {}
    for k, (level, _) in enumerate(drawn(rng, count, at_40, (0.0, 0.0)), 1):
        angle = np.concatenate([np.linspace(0.0, end, 89), np.linspace(end - 1.0, end - 6.0, 6)])
        normalised = level * (0.25 * (1.0 - np.exp(-angle / 1.5)) + 0.75 * (angle / 40.0) ** 3)
        normalised[89:] *= 0.7
        gamma = np.deg2rad(angle)
        force = noisy(rng, crosshead_of_normalised(normalised, gamma, fabric, frame), 30.0)
        head = [f"Probe;frame {k} (made up)", f"Rahmenlänge;{frame:.1f};mm", f"Gewebeseite;{fabric:.1f};mm"]
        rows = [f"{d:.4f};{f:.4f}" for d, f in zip(crosshead(gamma, frame), force, strict=True)]
        lines = [*head, "", "Traversenweg;Kraft", "mm;N", *rows]
        found[f"frame-{k}.csv"] = "\n".join(line.replace(".", ",") for line in lines) + "\n"
    return found


def overhangs(rng: np.random.Generator) -> dict[str, str]:
    """Tables of overhangs, four readings of each strip: both ends, both faces."""
    found = {}
    for direction, (count, mass, overhang) in OVERHANGS.items():
        head = [f"# cantilever, {direction} (made up)", f"area mass [g/m2],{mass:.0f}", "strip width [mm],50"]
        rows = ["specimen,overhang [cm]"]
        for k, (mean, _) in enumerate(drawn(rng, count, overhang, (0.0, 0.0)), 1):
            rows += [f"{k},{(mean + d) / 10.0:.2f}" for d in (3.0, -3.0, 1.5, -1.5)]
        found[f"cantilever-{direction}.csv"] = "\n".join([*head, "", *rows]) + "\n"
    return found


def frictions(rng: np.random.Generator) -> dict[str, str]:
    """Pull force of warp strips between two plates."""
    count, normal, (length, width), travel, kinetic = FRICTION
    found = {}
    for k, (level, _) in enumerate(drawn(rng, count, kinetic, (0.0, 0.0)), 1):
        way = np.linspace(0.0, travel, 81)
        force = level * np.where(way < 1.0, way, 1.0 + 0.12 * np.exp(1.0 - way))
        head = [f"specimen,friction warp {k} (made up)", f"normal force [kN],{normal / 1e3:.1f}"]
        head += [f"plate length [mm],{length:.0f}", f"plate width [mm],{width:.0f}", "", "displacement [mm],force [N]"]
        rows = [f"{d:.3f},{f:.2f}" for d, f in zip(way, noisy(rng, force, level), strict=True)]
        found[f"friction-{k}.csv"] = "\n".join([*head, *rows]) + "\n"
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
    return np.clip(shown, 0.0, force.max())


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
