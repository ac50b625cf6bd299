"""What ``--preset`` means: element counts, and at the meso scale the length of the strip. The only such table."""

from dataclasses import dataclass
from typing import Any

from knittest.config.run import Preset, Scale

#: clamp speed of a shell model [m/s]: the curve is an input and must come back within 1 %, which takes calm
MACRO_SPEED = 0.5
FULL_GAUGE = 200.0  # clamp distance of the paper [mm]; a shell model is cheap enough to keep it


@dataclass(frozen=True)
class PresetValues:
    """Shell side [mm], beams in a loop, beams in a wave, and clamp distance of the meso strip [mm]."""

    element_size: float
    elements_per_loop: int
    elements_per_wave: int
    meso_gauge_length: float


PRESETS: dict[Preset, PresetValues] = {
    "quick": PresetValues(element_size=10.0, elements_per_loop=32, elements_per_wave=6, meso_gauge_length=50.0),
    "standard": PresetValues(element_size=5.0, elements_per_loop=32, elements_per_wave=6, meso_gauge_length=100.0),
    "paper": PresetValues(element_size=5.0, elements_per_loop=32, elements_per_wave=6, meso_gauge_length=FULL_GAUGE),
}

#: what a preset decides, unless a file or an option says it
PRESET_PATHS: tuple[tuple[str, ...], ...] = (
    ("rig", "gauge_length"),
    ("model", "macro", "element_size"),
    ("model", "meso", "elements_per_loop"),
    ("model", "meso", "elements_per_wave"),
)


def preset_settings(preset: Preset, scale: Scale) -> dict[str, Any]:
    """Nested run settings of ``preset``; anything a file or an option says goes over them."""
    values = PRESETS[preset]
    solver = {"solver": {"speed": MACRO_SPEED}} if scale == "macro" else {}
    return solver | {
        "rig": {"gauge_length": values.meso_gauge_length if scale == "meso" else FULL_GAUGE},
        "model": {
            "preset": preset,
            "scale": scale,
            "meso": {
                "elements_per_loop": values.elements_per_loop,
                "elements_per_wave": values.elements_per_wave,
            },
            "macro": {"element_size": values.element_size},
        },
    }
