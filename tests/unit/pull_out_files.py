"""Files of made-up pull-outs: inlays that equal crossings hold."""

from dataclasses import dataclass

import numpy as np

from knittest.experiment.lab_table import ReadOptions
from knittest.laboratory.pull_out.lab_files import LAB

LENGTH, DENSITY, FRICTION = 50.0, 28.0, 0.02
PITCH, CROSSINGS = 100.0 / DENSITY, LENGTH * DENSITY / 100.0
SIZES = {"embedded_length_mm": LENGTH, "crossing_density_per_100_mm": DENSITY}
STRETCH = 0.2


@dataclass(frozen=True)
class Inlay:
    """Inlay that stretches by 0.2 mm after its ``slack`` until all of it slides by ``travel`` [mm]; its force has a
    ``wave`` every pitch. Columns are written times ``factors``, without the free end unless it was ``followed``.
    """

    travel: float = 20.0
    friction: float = FRICTION
    wave: float = 0.0
    slack: float = 0.0
    preload: float = 0.0
    noise: float = 0.0
    step: float = 0.01
    head: str = "Weg [mm];freies Ende [mm];Kraft [N]"
    factors: tuple[float, float, float] = (1.0, 1.0, 1.0)
    followed: bool = True


def export(path, **how):
    """Write the file of an :class:`Inlay` to ``path``."""
    one = Inlay(**how)
    way = np.arange(0.0, one.travel + 0.5 * one.step, one.step)
    tail = np.maximum(way - STRETCH - one.slack, 0.0)
    wave = 1.0 + one.wave * np.sin(np.pi * tail / PITCH) ** 2
    held = one.friction * np.maximum(LENGTH - tail, 0.0) / PITCH * wave
    force = np.clip((way - one.slack) / STRETCH, 0.0, 1.0) * held + one.preload
    force = force + one.noise * one.friction * CROSSINGS * np.random.default_rng(5).standard_normal(len(way))
    table = np.column_stack([way, tail, force]) * one.factors
    rows = [";".join(f"{v:.6f}" for v in (row if one.followed else row[[0, 2]])) for row in table]
    path.write_text("\n".join([one.head, *rows]).replace(".", ",") + "\n", encoding="utf-8")
    return path


def pull(path, clamped="sides", sizes=None, **given):
    """Inlay that is read from ``path``."""
    (one,) = LAB.read(path, ReadOptions(clamped=clamped, sizes=SIZES if sizes is None else sizes, **given))
    return one


def found(*pulls):
    """Values of each row of ``pulls``."""
    return {name: values.tolist() for name, values in LAB.results(pulls, "weft", []).found.items()}
