"""Points of a strip at which the material's shear angle is known: shells, or crossings of yarns."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from knittest.base.history import Frame, History
from knittest.laboratory.bias_extension.config import BiasExtensionRun
from knittest.laboratory.bias_extension.pin_jointed import strip_of
from knittest.laboratory.bias_extension.yarns import yarns_on_the_bias
from knittest.laboratory.law_end import shell_areas
from knittest.laboratory.shear_angles import shell_angles

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Material:
    """``places`` (n, 2) [mm] at the start and ``weights`` (n,); of a frame the shear ``angles`` [rad], (n,), positive
    where the pull shears, what is ``drawn``: polygons (n, 4, 2) or points (n, 2) [mm], and the ``slip`` [mm], (n,), of
    yarns.
    """

    places: Array
    weights: Array
    angles: Callable[[Frame], Array]
    drawn: Callable[[Frame], Array]
    slip: Callable[[Frame], Array] | None = None


def material_of(run: BiasExtensionRun, history: History) -> Material:
    """Material of the first specimen of ``run``."""
    return _shells(history) if history.mesh.kind == "shells" else _yarns(run, history)


def _shells(history: History) -> Material:
    cells = history.mesh.cells
    corners = history.frames[0].position[cells]

    def drawn(frame: Frame) -> Array:
        return frame.position[cells][:, :, :2]

    return Material(corners.mean(axis=1)[:, :2], shell_areas(corners), shell_angles, drawn)


def _yarns(run: BiasExtensionRun, history: History) -> Material:
    found, start = yarns_on_the_bias(run, strip_of(run)).crossings(), history.frames[0]

    def slip(frame: Frame) -> Array:
        return found.slip(start, frame)

    places = found.places(start)
    return Material(places, np.ones(len(places)), found.angles, found.places, slip)
