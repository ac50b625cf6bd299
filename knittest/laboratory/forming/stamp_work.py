"""Work of the stamp, and what it went into, mechanism by mechanism and alike for shells and yarns."""

import numpy as np
from numpy.typing import NDArray

from knittest.base.history import History

Array = NDArray[np.float64]
Table = dict[str, Array]

#: mechanisms with the columns of the energies that they sum up: those after "less" are taken off
MECHANISMS: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "stretching": (("stretching_warp_mj", "stretching_weft_mj", "stretching_fabric_mj"), ()),
    "bending": (("bending_warp_mj", "bending_weft_mj", "bending_fabric_mj"), ()),
    "in_plane_bending": (("in_plane_bending_fabric_mj",), ()),
    "torsion": (("torsion_warp_mj", "torsion_weft_mj"), ()),
    "loop_stretching": (("stretching_knit_mj",), ()),
    "loop_bending": (("bending_knit_mj",), ()),
    "loop_torsion": (("torsion_knit_mj",), ()),
    "shear": (("shear_fabric_mj",), ()),
    "fabric_contact": (("contact_mj",), ("contact_tools_mj", "contact_recovery_mj")),
    "fabric_friction": (("friction_mj",), ("friction_tools_mj",)),
    "tool_contact": (("contact_tools_mj",), ()),
    "tool_friction": (("friction_tools_mj",), ()),
    "hourglass": (("hourglass_mj",), ()),
    "damping": (("damping_mj", "contact_damping_mj"), ()),
    "kinetic": (("kinetic_mj",), ()),
    "torn": (("eroded_mj",), ()),
    "balance_error": (("balance_error_mj",), ()),
}
#: what a legend says of them
LABELS = {
    "stretching": "stretching of inlays",
    "bending": "bending of inlays",
    "in_plane_bending": "bending of inlays in the plane",
    "torsion": "torsion of inlays",
    "loop_stretching": "stretching of loops",
    "loop_bending": "bending of loops",
    "loop_torsion": "torsion of loops",
    "shear": "shear",
    "fabric_contact": "contact of the fabric with itself",
    "fabric_friction": "friction in the fabric",
    "tool_contact": "contact with tools",
    "tool_friction": "friction at tools",
    "hourglass": "hourglass control",
    "damping": "damping",
    "kinetic": "kinetic",
    "torn": "torn elements",
    "balance_error": "error of the balance",
}


def stamp_work(history: History) -> Table:
    """Table over the rows of the energies: travel [mm], work of the stamp and of holder and weight, and energy or loss
    of each of :data:`MECHANISMS` that the model has [mJ], which together are both works.

    The bending of yarns is that in the plane too, which shells have apart.
    """
    curve, energies = history.curve, history.energies
    travel, force = curve["stamp_travel_mm"], curve["stamp_force_n"]
    steps = np.diff(travel, prepend=0.0)
    before = np.append(force[:1], force[:-1])
    work = np.interp(energies["time_ms"], curve["time_ms"], np.cumsum(0.5 * (before + force) * steps))
    found = {
        "stamp_travel_mm": np.interp(energies["time_ms"], curve["time_ms"], travel),
        "stamp_mj": work,
        "holder_and_weight_mj": energies["external_mj"] - work,
    }
    for name, (plus, less) in MECHANISMS.items():
        columns = [energies[column] for column in plus if column in energies]
        if columns:
            taken = sum((energies[column] for column in less), np.zeros_like(work))
            found[f"{name}_mj"] = np.sum(columns, axis=0) - taken
    return found
