"""State of yarns that have come to rest: tension of the loops, their wrap, forces of crossings, thickness."""

import numpy as np

from knittest.base.rest import Rest
from knittest.kernels.monitor import axial_state
from knittest.models.crossings import crossings, surfaces
from knittest.models.explicit_model import ExplicitModel
from knittest.models.wrap import least_wrap
from knittest.models.yarn_model import YarnModel

#: part of the loops
LOOPS = "knit"


def at_rest(model: ExplicitModel, residual: float = np.nan) -> Rest | None:
    """State of ``model``, out of balance by ``residual`` [-], where it is ``typical``; None of shells.

    The edge of a specimen, where loops that nothing holds have shed their tension, does not count.
    """
    if not isinstance(model, YarnModel):
        return None
    typical = model.typical()
    pieces = np.flatnonzero(typical & model.group.is_piece)
    low, high = surfaces(model, pieces) if pieces.size else (np.nan, np.nan)
    force = axial_state(model.nodes, model.parts, model.beams)[1][model.element_node]
    names = model.mesh.part_names
    loops = typical[model.element_node] & (model.mesh.part == (names.index(LOOPS) if LOOPS in names else -1))
    tension = float(force[loops].mean()) if loops.any() else 0.0
    pressed = {kind: of.normal_force for kind, of in crossings(model, typical).items()}
    return Rest(tension, high - low, residual, pressed, least_wrap(model, LOOPS, typical))
