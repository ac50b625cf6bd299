"""Meaning of ``--preset``: element counts, and at the meso scale the length of the strip. The only such table."""

from dataclasses import dataclass
from typing import Any

from knittest.config.run import Preset, Scale

FULL_GAUGE = 200.0  # clamp distance of the paper [mm]; a shell model is cheap enough to keep it
#: eight beams a wave: with six the one-point beam resists straightening by 22 % too much, with four by 62 %
ELEMENTS_PER_LOOP, ELEMENTS_PER_WAVE = 30, 8

#: (beams a loop, beams a wave) of tests that need fewer: what slides is the loops' crowns, and these are the 26,000
#: beams of the paper's strip; with 30 and 8 the pull force changes by 0.6 %, the compression by 4 %
COARSER: dict[str, tuple[int, int]] = {
    "friction": (22, 6),
    "picture-frame": (30, 4),
    "cantilever": (24, 4),
    "forming": (20, 4),
}


@dataclass(frozen=True)
class PresetValues:
    """Shell side [mm]; at the meso scale clamp distance of the tensile strip, widths of the friction and the cantilever
    strip, side of the picture frame [mm] and speed of the stamp [m/s]; shell side of the blank [mm].
    """

    element_size: float
    meso_gauge_length: float
    meso_width: float
    meso_bent_width: float
    meso_side: float
    meso_stamp_speed: float
    blank_element: float


PRESETS: dict[Preset, PresetValues] = {
    "quick": PresetValues(
        element_size=10.0,
        meso_gauge_length=50.0,
        meso_width=15.0,
        meso_bent_width=25.0,  # with four yarns one that sticks out keeps the strip from its rest
        meso_side=50.0,
        meso_stamp_speed=0.2,
        blank_element=6.0,
    ),
    "standard": PresetValues(
        element_size=5.0,
        meso_gauge_length=100.0,
        meso_width=25.0,
        meso_bent_width=25.0,
        meso_side=100.0,
        meso_stamp_speed=0.5,
        blank_element=3.0,
    ),
    "paper": PresetValues(
        element_size=5.0,
        meso_gauge_length=FULL_GAUGE,
        meso_width=50.0,
        meso_bent_width=50.0,
        meso_side=200.0,
        meso_stamp_speed=0.55,
        blank_element=2.0,
    ),
}

#: blank, stroke and stamp of the yarns' forming test where they are not those of the rig, scaled down: a tenth and a
#: half of the beams; gaps and floor stay, because the fabric is as thick
SMALLER: dict[Preset, dict[str, Any]] = {
    "quick": {
        "blank_length": 120.0,
        "blank_width": 120.0,
        "depth": 15.0,
        "stamp": {
            "t": {
                "bar_length": 56.0, "bar_width": 20.0, "stem_length": 36.0, "stem_width": 20.0, "edge_radius": 4.0,
                "outer_corner_radius": 5.0, "inner_corner_radius": 12.0,
            },
            "hemisphere": {"radius": 20.0},
        },
        "die": {"clearance": 6.0, "edge_radius": 4.0},
        "holder": {"clearance": 6.0},
    },
    "standard": {
        "blank_length": 230.0,
        "blank_width": 230.0,
        "depth": 28.0,
        "stamp": {
            "t": {
                "bar_length": 105.0, "bar_width": 35.0, "stem_length": 70.0, "stem_width": 35.0, "edge_radius": 6.0,
                "outer_corner_radius": 9.0, "inner_corner_radius": 16.0,
            },
            "hemisphere": {"radius": 35.0},
        },
        "die": {"edge_radius": 6.0},
    },
    "paper": {},
}  # fmt: skip

#: solver settings by test and scale, where they are not the solver's defaults. A tension curve is an input of the
#: shells and must come back within 1 %, which takes calm, and a shell breaks at its largest strain: central differences
#: swell the waves of an element by 1 / sqrt(1 - (omega dt / 2)^2). What slides must not be held back by damping: m c v
#: is a force; the friction test is seen from the clamp, where the strip hardly moves. Penalties grow with the inverse
#: square of the step: folds of shells, plates and yarns on tools want them stiff
SOLVER: dict[tuple[str, Scale], dict[str, float]] = {
    ("tensile", "macro"): {"speed": 0.5, "safety": 0.55},
    ("friction", "macro"): {"speed": 1.0, "ramp": 0.5, "damping": 1.0, "safety": 0.55},
    ("friction", "meso"): {"speed": 2.0, "ramp": 0.5, "damping": 5.0},
    ("picture-frame", "macro"): {"speed": 0.5, "ramp": 5.0, "damping": 0.002},
    ("forming", "macro"): {"speed": 0.19, "ramp": 20.0, "damping": 0.05, "safety": 0.65},
    ("forming", "meso"): {"ramp": 10.0, "damping": 0.05, "safety": 0.7},
    ("picture-frame", "meso"): {"speed": 3.0, "damping": 0.01, "safety": 0.7},
}

#: forming of shells without a holder: a flange that little but its weight keeps down must not be dragged by damping
FREE_BLANK: dict[str, float] = {"speed": 0.05, "damping": 0.006}

#: what a preset decides, unless a file or an option says it
PRESET_PATHS: tuple[tuple[str, ...], ...] = (
    ("rig", "gauge_length"),
    ("rig", "width"),
    ("rig", "side"),
    ("rig", "blank_length"),
    ("rig", "blank_width"),
    ("rig", "depth"),
    ("model", "macro", "element_size"),
    ("model", "meso", "elements_per_loop"),
    ("model", "meso", "elements_per_wave"),
)


def default_scale(kind: str) -> Scale:
    """Scale of a test unless one is asked for: bending is an input of both, which the shells are faster to confirm, and
    a whole blank is theirs in minutes.
    """
    return "macro" if kind in ("cantilever", "forming") else "meso"


def preset_settings(kind: str, preset: Preset, scale: Scale, held: bool = False) -> dict[str, Any]:
    """Nested run settings of ``preset`` for a test of ``kind``, of forming with a blank that is ``held`` or not.

    Anything a file or an option says goes over them.
    """
    values = PRESETS[preset]
    per_loop, per_wave = COARSER.get(kind, (ELEMENTS_PER_LOOP, ELEMENTS_PER_WAVE))
    forming = kind == "forming"
    macro: dict[str, Any] = {"element_size": values.blank_element if forming else values.element_size}
    if forming:  # its folds touch
        macro["self_contact"] = True
    model = {
        "preset": preset,
        "scale": scale,
        "meso": {"elements_per_loop": per_loop, "elements_per_wave": per_wave},
        "macro": macro,
    }
    settings: dict[str, Any] = {"model": model, "rig": _dimensions(kind, preset, values) if scale == "meso" else {}}
    if (kind, scale) in SOLVER:
        settings["solver"] = dict(SOLVER[kind, scale])
    if (kind, scale) == ("forming", "macro") and not held:
        settings["solver"] |= FREE_BLANK
    if (kind, scale) == ("forming", "meso"):  # less work is done on a small piece: its inertia must be smaller too
        settings["solver"]["speed"] = values.meso_stamp_speed
    if (kind, scale) == ("picture-frame", "meso"):  # shear waves cross a large square later
        settings["solver"]["ramp"] = max(2.0, values.meso_side / 50.0)
    return settings


def _dimensions(kind: str, preset: Preset, values: PresetValues) -> dict[str, Any]:
    if kind == "forming":
        return SMALLER[preset]
    if kind == "tensile":
        return {"gauge_length": values.meso_gauge_length}
    if kind == "picture-frame":
        return {"side": values.meso_side}
    return {"width": values.meso_bent_width if kind == "cantilever" else values.meso_width}
