"""Presets of the forming test."""

from knittest.base.kinds import Stated

#: side of a shell of the blank [mm], and speed of the stamp on yarns [m/s]
ELEMENT = {"quick": 6.0, "standard": 3.0, "paper": 2.0}
SPEED = {"quick": 0.2, "standard": 0.5, "paper": 0.5}

#: blank, stroke and stamp of the yarns' forming test where they are not those of the rig, scaled down: a tenth and a
#: half of the beams; gaps and floor stay, because the fabric is as thick
SMALLER: dict[str, dict[str, object]] = {
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

#: forming of shells without a holder: a flange that little but its weight keeps down must not be dragged by damping
FREE_BLANK: dict[str, float] = {"speed": 0.05, "damping": 0.006}


def settings(preset: str, scale: str, stated: Stated) -> dict[str, object]:
    """Settings of ``preset`` at ``scale``, of shells for a blank that a stated force holds or not.

    Penalties grow with the inverse square of the step: folds of shells and yarns on tools want them stiff.
    """
    model = {
        "meso": {"elements_per_loop": 20, "elements_per_wave": 4},
        "macro": {"element_size": ELEMENT[preset], "self_contact": True},  # its folds touch
    }
    if scale == "meso":  # less work is done on a small piece: its inertia must be smaller too
        solver = {"ramp": 10.0, "damping": 0.05, "safety": 0.7, "speed": SPEED[preset]}
        return {"model": model, "rig": SMALLER[preset], "solver": solver}
    force = stated("blank_holder_force")
    held = isinstance(force, int | float) and force > 0.0
    free = {} if held else FREE_BLANK
    return {"model": model, "solver": {"speed": 0.19, "ramp": 20.0, "damping": 0.05, "safety": 0.9} | free}
