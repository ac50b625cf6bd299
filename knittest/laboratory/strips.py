"""Strips of yarns, cut along warp or weft, with the scatter of their yarns."""

from dataclasses import dataclass, replace
from math import ceil, floor

import numpy as np

from knittest.config.fabric import Direction
from knittest.config.rigs import StripRig
from knittest.config.run import Run
from knittest.fabric.relax import relaxed_cell
from knittest.fabric.strip import YarnPath, strip, wave_elements, wave_scale
from knittest.fabric.variability import YarnDraws, draw
from knittest.solve.observer import SILENT, Observer

AXIS = {"warp": 1, "weft": 0}


@dataclass(frozen=True)
class YarnStrip:
    """Paths and draws of a piece of fabric of whole pitches; ``table`` is that of yarns.csv."""

    paths: list[YarnPath]
    draws: dict[str, YarnDraws]
    table: dict[str, np.ndarray]


def yarns_across(run: Run, direction: Direction, specimen: int = 0) -> int:
    """Whole yarns of ``direction`` in the width; a fractional count goes down or up, alternately in an ensemble."""
    assert isinstance(run.rig, StripRig)
    exact = run.rig.width_mm * run.fabric.density_per_mm.of(direction)
    if abs(exact - round(exact)) < 0.25:
        return max(round(exact), 1)
    up = (run.rig.yarn_rounding == "up") != (run.variability.specimens > 1 and specimen % 2 == 1)
    return max(ceil(exact) if up else floor(exact), 1)


def carrying_width(run: Run, direction: Direction, specimen: int = 0) -> float:
    """Width [mm] that carries the force of a strip: its own of shells, that of its whole yarns of yarns."""
    assert isinstance(run.rig, StripRig)
    if run.model.scale == "macro":
        return run.rig.width_mm
    return yarns_across(run, direction, specimen) / run.fabric.density_per_mm.of(direction)


def pitch(run: Run, direction: Direction) -> float:
    """Distance of the yarns across a strip of ``direction`` [mm]: the period along it."""
    return run.fabric.course_spacing if direction == "warp" else run.fabric.wale_spacing


def cut(
    run: Run,
    n_wales: int,
    n_courses: int,
    specimen: int = 0,
    observer: Observer = SILENT,
    gripped: tuple[Direction, float] | None = None,
) -> YarnStrip:
    """Yarn paths of ``n_wales`` by ``n_courses`` cells; ``gripped`` names a system whose yarns are held over a share of
    their length at both ends, so that their weakest place lies between.
    """
    observer.phase("laying out the yarns")  # the cell was relaxed, and announced, before the folder was opened
    cell = relaxed_cell(run.fabric)
    counts = {"warp": n_wales, "weft": n_courses, "knit": n_courses}
    draws = {s: draw(run.fabric, run.variability, s, n, specimen) for s, n in counts.items()}
    if gripped is not None:
        system, share = gripped
        draws[system] = replace(draws[system], weakest=share + (1.0 - 2.0 * share) * draws[system].weakest)
    table = _yarn_table(draws)
    draws |= {s: _slack_as_wave(run, s, draws[s]) for s in AXIS}
    mesh = run.model.meso
    amplitude = {
        s: wave_scale(cell, s, wave_elements(cell, s, mesh.elements_per_wave)) * draws[s].amplitude for s in AXIS
    }
    paths = strip(cell, n_wales, n_courses, mesh.elements_per_loop, mesh.elements_per_wave, amplitude)
    if not mesh.knitting:
        paths = [p for p in paths if p.system != "knit"]
    return YarnStrip(paths, draws, table)


def _slack_as_wave(run: Run, system: str, draws: YarnDraws) -> YarnDraws:
    """Add the slack of wavy yarns to their wave, as length that straightens first; straight yarns keep it in their law.

    A law that carries nothing up to the slack makes a yarn a row of loose links, which rattle when they are pulled.
    """
    crimp = run.fabric.reinforcing.crimp_fraction.of(system)
    if crimp <= 0.0:
        return draws
    wider = np.sqrt(1.0 + draws.slack / crimp)
    return replace(draws, amplitude=draws.amplitude * wider, slack=np.zeros_like(draws.slack))


def _yarn_table(draws: dict[str, YarnDraws]) -> dict[str, np.ndarray]:
    systems = list(draws)
    table = {
        "system": np.concatenate([[s] * len(draws[s].slack) for s in systems]),
        "yarn": np.concatenate([np.arange(1, len(draws[s].slack) + 1) for s in systems]),
        "fracture_strain_pct": np.concatenate([100.0 * draws[s].fracture_strain for s in systems]),
        "slack_pct": np.concatenate([100.0 * draws[s].slack for s in systems]),
        "wave_amplitude_relative": np.concatenate([draws[s].amplitude for s in systems]),
    }
    if (loop := draws["knit"].loop) is not None:
        table["loop_length_relative"] = np.concatenate(
            [loop if s == "knit" else np.ones_like(draws[s].slack) for s in systems]
        )
    return table
