"""Meaning of ``--preset``: element counts, and what the test itself sets."""

from dataclasses import dataclass
from typing import Any, get_args

from knittest.base.kinds import Stated, kinds
from knittest.config.run import Preset, Scale

#: eight beams a wave: with six the one-point beam resists straightening by 22 % too much, with four by 62 %
ELEMENTS_PER_LOOP, ELEMENTS_PER_WAVE = 30, 8


@dataclass(frozen=True)
class PresetValues:
    """Shell side [mm]."""

    element_size: float


PRESETS: dict[Preset, PresetValues] = {
    "quick": PresetValues(element_size=10.0),
    "standard": PresetValues(element_size=5.0),
    "paper": PresetValues(element_size=5.0),
}

#: what a preset decides of every model, unless a file or an option says it
MODEL_PATHS: tuple[tuple[str, ...], ...] = (
    ("model", "macro", "element_size"),
    ("model", "meso", "elements_per_loop"),
    ("model", "meso", "elements_per_wave"),
)


def preset_paths(kind: str) -> tuple[tuple[str, ...], ...]:
    """Fields that a preset decides of a test of ``kind``, unless a file or an option says it."""
    return (*(("rig", name) for name in kinds()[kind].sizes), *MODEL_PATHS)


def default_scale(kind: str) -> Scale:
    """Scale of a test unless one is asked for."""
    scale: Scale = kinds()[kind].scale  # type: ignore[assignment]
    if scale not in get_args(Scale):
        raise ValueError(f"test {kind}: scale = {scale!r}: expected one of {get_args(Scale)}")
    return scale


def nothing(field: str) -> None:
    """Return None: no field of the rig is stated."""


def preset_settings(kind: str, preset: Preset, scale: Scale, stated: Stated = nothing) -> dict[str, Any]:
    """Nested run settings of ``preset`` for a test of ``kind`` of whose rig fields are ``stated``.

    Anything a file or an option says goes over them.
    """
    model = {
        "preset": preset,
        "scale": scale,
        "meso": {"elements_per_loop": ELEMENTS_PER_LOOP, "elements_per_wave": ELEMENTS_PER_WAVE},
        "macro": {"element_size": PRESETS[preset].element_size},
    }
    settings: dict[str, Any] = {"model": model, "rig": {}}
    record = kinds()[kind]
    if record.presets:
        _lay(settings, record.load("presets")(preset, scale, stated))
    return settings


def _lay(under: dict[str, Any], over: dict[str, Any]) -> None:
    for name, value in over.items():
        if isinstance(value, dict):
            _lay(under.setdefault(name, {}), value)
        else:
            under[name] = value
