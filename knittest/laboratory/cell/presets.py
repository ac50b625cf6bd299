"""Presets of the cell test."""

from typing import Any

from knittest.base.kinds import Stated

#: repeats either way
REPEATS = {"quick": 1, "standard": 2, "paper": 2}
#: speed [m/s] of 100 mm of fabric, and start [ms]: at half of it forces stay within 0.5 %
SPEED = {"shear": 2.4, "warp": 0.4, "weft": 0.4, "biaxial": 0.4, "bending": 0.25, "compaction": 1.5}
FROM_A_FILE, START = 2.4, 4.0
#: nodes of a larger cell follow later: these go slower by its repeats
SLOWER = ("shear",)
#: paths that pull no yarn: a wave of four beams, as in frames
FINE = ("warp", "weft", "biaxial")


def settings(preset: str, scale: str, stated: Stated) -> dict[str, Any]:
    """Settings of ``preset`` for the path that is stated: it takes 10 to 60 ms."""
    path = str(stated("path") or "shear")
    model = {} if path in FINE or path not in SPEED else {"meso": {"elements_per_wave": 4}}
    slower = path in SLOWER or path not in SPEED
    speed = SPEED.get(path, FROM_A_FILE) / (REPEATS[preset] if slower else 1)
    return {
        "rig": {"wales": REPEATS[preset], "courses": REPEATS[preset]},
        "model": model,
        "solver": {"speed": speed, "ramp": START, "damping": 0.01, "safety": 0.9},
    }
