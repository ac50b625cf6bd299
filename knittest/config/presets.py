"""Values of ``--preset``: element counts, and settings of the test."""

from typing import Any, get_args

from knittest.base.kinds import Stated, kinds
from knittest.config.run import Preset, Scale

#: beams per wave: a one-point beam resists straightening by 22 % too much with six and by 62 % with four
ELEMENTS_PER_LOOP, ELEMENTS_PER_WAVE = 30, 8
#: side of a shell element [mm] by preset
PRESETS: dict[Preset, float] = {"quick": 10.0, "standard": 5.0, "paper": 5.0}


def preset_paths(kind: str) -> tuple[tuple[str, ...], ...]:
    """Fields of a test of ``kind`` that a preset sets, unless a file or an option does."""
    meso = (("model", "meso", name) for name in ("elements_per_loop", "elements_per_wave"))
    return (*(("rig", name) for name in kinds()[kind].sizes), ("model", "macro", "element_size"), *meso)


def default_scale(kind: str) -> Scale:
    """Default scale of a test."""
    scale: Scale = kinds()[kind].scale  # type: ignore[assignment]
    if scale not in get_args(Scale):
        raise ValueError(f"test {kind}: scale = {scale!r}: expected one of {get_args(Scale)}")
    return scale


def preset_settings(kind: str, preset: Preset, scale: Scale, stated: Stated = lambda field: None) -> dict[str, Any]:
    """Nested run settings of ``preset`` for a test of ``kind``; ``stated`` returns a rig field of files and options."""
    model = {
        "preset": preset,
        "scale": scale,
        "meso": {"elements_per_loop": ELEMENTS_PER_LOOP, "elements_per_wave": ELEMENTS_PER_WAVE},
        "macro": {"element_size": PRESETS[preset]},
    }
    settings: dict[str, Any] = {"model": model, "rig": {}}
    record = kinds()[kind]
    if record.presets:
        _merge(settings, record.load("presets")(preset, scale, stated))
    return settings


def _merge(under: dict[str, Any], over: dict[str, Any]) -> None:
    for name, value in over.items():
        if isinstance(value, dict):
            _merge(under.setdefault(name, {}), value)
        else:
            under[name] = value
