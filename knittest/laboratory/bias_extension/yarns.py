"""Strip of yarns on the bias: its paths, what the jaws hold, and where warp and weft cross."""

from dataclasses import dataclass, replace
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from knittest.base.history import Frame
from knittest.config.fabric import Fabric
from knittest.config.run import MesoModel
from knittest.fabric.bias import CutPath, cells_under, cut_on_the_bias
from knittest.laboratory.bias_extension.config import BiasExtensionRun
from knittest.laboratory.bias_extension.pin_jointed import BiasStrip
from knittest.laboratory.strips import YarnStrip, cut
from knittest.models.meso import chain_order
from knittest.solve.observer import SILENT, Observer

Array = NDArray[np.float64]
Index = NDArray[np.int64]

#: length of strip inside each jaw over the diagonal of a cell: enough to grip every yarn
JAW_CELLS = 1.0
#: elements of the shortest piece of warp or weft that stays in the strip
SHORTEST = 4


@dataclass(frozen=True)
class Crossings:
    """Nodes at the start of the pitch of warp and of weft about each crossing, at it, and at the end, (n, 3) each."""

    warp: Index
    weft: Index

    def angles(self, frame: Frame) -> Array:
        """Shear angle [rad] at each crossing, (n,), positive where the pull shears."""
        one, other = (frame.position[nodes[:, 2]] - frame.position[nodes[:, 0]] for nodes in (self.warp, self.weft))
        cosine = np.sum(one * other, axis=1) / np.linalg.norm(one, axis=1) / np.linalg.norm(other, axis=1)
        angle: Array = np.arcsin(cosine)
        return angle

    def places(self, frame: Frame) -> Array:
        """Place of each crossing, (n, 2) [mm]."""
        place: Array = 0.5 * (_at(frame, self.warp) + _at(frame, self.weft))
        return place

    def slip(self, start: Frame, frame: Frame) -> Array:
        """Way [mm] in the plane that the yarns of each crossing have moved against each other since ``start``, (n,)."""
        apart = [_at(one, self.warp) - _at(one, self.weft) for one in (start, frame)]
        way: Array = np.linalg.norm(apart[1] - apart[0], axis=1)
        return way


def _at(frame: Frame, nodes: Index) -> Array:
    """Place of a yarn at each crossing, (n, 2) [mm]."""
    place: Array = frame.position[nodes[:, 1], :2]
    return place


@dataclass(frozen=True)
class YarnsOnTheBias:
    """Pieces of yarn in the strip and its jaws, in the order of the model's chains, cut from ``piece`` of
    ``n_wales`` by ``n_courses`` cells.
    """

    piece: YarnStrip
    paths: list[CutPath]
    n_wales: int
    n_courses: int

    def crossings(self) -> Crossings:
        """Crossings of whole pitches of warp and weft in the strip."""
        pitches = {"warp": self.n_courses, "weft": self.n_wales}
        found: dict[str, dict[tuple[int, int], tuple[int, int, int]]] = {system: {} for system in pitches}
        start = 0
        for path in self.paths:
            if path.system in pitches:
                number = pitches[path.system]
                step = (len(path.uncut.points) - 1) // number
                own = range(path.first, path.first + len(path.points))
                for k in range(number):
                    if k * step in own and (k + 1) * step in own:
                        place = (path.index, k) if path.system == "warp" else (k, path.index)
                        here = start + k * step - path.first
                        found[path.system][place] = (here, here + step // 2, here + step)  # an even number of beams
            start += len(path.points)
        both = sorted(found["warp"].keys() & found["weft"].keys())
        warp, weft = (np.array([found[s][place] for place in both], np.int64).reshape(-1, 3) for s in pitches)
        return Crossings(warp, weft)


def jaw_length(fabric: Fabric) -> float:
    """Length of strip inside each jaw [mm]."""
    return JAW_CELLS * sqrt(2.0) * max(fabric.wale_spacing, fabric.course_spacing)


def yarns_on_the_bias(
    run: BiasExtensionRun, strip: BiasStrip, specimen: int = 0, observer: Observer = SILENT
) -> YarnsOnTheBias:
    """Yarns of the strip, about the origin."""
    fabric, end = run.fabric, 0.5 * strip.length
    length = strip.length + 2.0 * jaw_length(fabric)
    pitches = fabric.wale_spacing, fabric.course_spacing
    n_wales, n_courses = cells_under(length, strip.width, pitches)
    piece = cut(run, n_wales, n_courses, specimen, observer)
    middle = 0.5 * np.array([n_wales * pitches[0], n_courses * pitches[1], 0.0])
    paths = [replace(path, points=path.points - middle) for path in piece.paths]
    found = cut_on_the_bias(paths, length, strip.width, _least(run.model.meso))
    free = [path for path in found if np.abs(path.points[:, 1]).min() < end]  # the rest lies in a jaw
    return YarnsOnTheBias(piece, sorted(free, key=chain_order), n_wales, n_courses)


def _least(mesh: MesoModel) -> dict[str, int]:
    """Elements of the shortest piece by system: of the loops one, which the rows beside it hold."""
    return {"warp": SHORTEST, "weft": SHORTEST, "knit": mesh.elements_per_loop}
