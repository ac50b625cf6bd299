"""Strip on the bias: kinematics of pin-jointed yarns, its force by the fabric's shear law, its mesh, its yarns."""

from dataclasses import dataclass
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import InputError
from knittest.base.history import Array, Frame
from knittest.config.fabric import Fabric
from knittest.config.run import Run
from knittest.config.structure import DIRECTIONS, KNIT, repeat_of
from knittest.fabric.strip import CutPath, cells_for_bias_strip, cut_on_the_bias
from knittest.laboratory.base import shear_curve
from knittest.laboratory.bias_extension.config import BiasExtensionRun
from knittest.laboratory.strips import YarnStrip, centre_paths, cut_piece, full_layer, has_all_crossings
from knittest.materials.shear import shear_table
from knittest.materials.trellis import crosshead, frame_angle
from knittest.materials.yarn_section import systems_of
from knittest.models.meso import in_chain_order
from knittest.solve.state import SILENT, Observer

Index = NDArray[np.int64]

# Pin-jointed kinematics of the bias extension test: yarns that keep their length and are hinged where they cross.
#
# A strip of length H between the clamps and width W, H >= 2 W, its yarns at +-45 deg to the pull, has three zones. Next
# to the clamps both yarns of a crossing are held: nothing is sheared. In the middle neither is: the shear angle is
# gamma over an area of W (2 H - 3 W) / 2. Between them one is, and the angle is gamma / 2 over an area of W^2. The
# middle is a frame with the diagonal L0 = H - W (Lebrun et al. 2003), so that
#
#     gamma = 90 deg - 2 acos((L0 + d) / (sqrt(2) L0)),    dd/dgamma = L0 (cos gamma/2 - sin gamma/2) / 2.
#
# With S, the shear force conjugate to the angle (:mod:`knittest.materials.trellis`), the power F dd is that of both
# zones:
#
#     F L0 (cos gamma/2 - sin gamma/2) = W (2 H - 3 W) S(gamma) + W^2 S(gamma/2).
#
# Solved for S(gamma) = F_sh(gamma) cos gamma this is the normalised shear force F_sh of Cao et al. (2008), Composites
# Part A 39, 1037-1053, and of Launay et al. (2008), Compos. Sci. Technol. 68, 506-515. Lengths in mm, forces in N.

#: length over width from which on the middle is a zone of its own
LEAST_SLENDERNESS = 2.0


@dataclass(frozen=True)
class BiasStrip:
    """Length between the clamps and width [mm] of a strip at least twice as long as wide."""

    length: float
    width: float

    def __post_init__(self) -> None:
        if not self.length >= LEAST_SLENDERNESS * self.width * (1.0 - 1e-9):
            raise InputError(
                f"a strip {self.length:g} mm long and {self.width:g} mm wide: expected at least "
                f"{LEAST_SLENDERNESS:g} times the "
                f"width between the clamps, {LEAST_SLENDERNESS * self.width:g} mm: else yarns run from clamp to clamp"
            )

    @property
    def middle(self) -> float:
        """L0 = H - W [mm]: diagonal of the frame that the middle is."""
        return self.length - self.width

    @property
    def areas(self) -> tuple[float, float]:
        """Area [mm2] that is sheared by gamma, and that is sheared by gamma / 2."""
        return 0.5 * self.width * (2.0 * self.length - 3.0 * self.width), self.width**2

    def angle(self, travel: float) -> float:
        """Shear angle [rad] of the middle at a travel [mm] of the clamp.

        >>> round(np.rad2deg(BiasStrip(200.0, 100.0).angle(22.474)).item(), 2)
        30.0
        """
        return frame_angle(travel, self.middle / sqrt(2.0))

    def travel(self, angle: float) -> float:
        """Travel [mm] of the clamp at a shear angle [rad]."""
        return crosshead(angle, self.middle / sqrt(2.0))

    @property
    def longest(self) -> float:
        """Travel [mm] at which the yarns of the middle lie side by side."""
        return (sqrt(2.0) - 1.0) * self.middle

    def force(self, shear: Array, half: Array, angle: Array) -> Array:
        """Force of the clamp [N] of S(gamma) ``shear`` and S(gamma / 2) ``half`` [N/mm] at ``angle`` [rad], (n,).

        >>> angle = np.deg2rad([20.0])  # S = 0.1 N/mm times the angle
        >>> BiasStrip(200.0, 100.0).force(0.1 * angle, 0.05 * angle, angle).round(2)
        array([6.45])
        """
        whole, partly = self.areas
        lever = np.cos(0.5 * angle) - np.sin(0.5 * angle)  # 2 / L0 dd/dgamma
        return np.asarray(2.0 * (shear * whole + 0.5 * half * partly) / (self.middle * lever))

    def conjugate(self, force: Array, angle: Array) -> Array:
        """S [N/mm] of the clamp's force [N] at ``angle`` [rad], rising, (n,): S(gamma) depends on S(gamma / 2)."""
        from scipy.sparse import csr_array
        from scipy.sparse.linalg import spsolve_triangular

        grid, pull = (np.append(0.0, angle), np.append(force[0], force)) if angle[0] > 0.0 else (angle, force)
        whole, partly = self.areas
        n = len(grid)
        after = np.searchsorted(grid, 0.5 * grid, side="right").clip(1, n - 1)
        share = (0.5 * grid - grid[after - 1]) / (grid[after] - grid[after - 1])
        rows = np.arange(n)
        system = csr_array(
            (
                np.concatenate([np.full(n, whole), 0.5 * partly * (1.0 - share), 0.5 * partly * share]),
                (np.tile(rows, 3), np.concatenate([rows, after - 1, after])),
            ),
            shape=(n, n),
        )
        lever = np.cos(0.5 * grid) - np.sin(0.5 * grid)
        found: Array = spsolve_triangular(system, 0.5 * pull * self.middle * lever)
        return found[n - len(angle) :]

    def normalised_force(self, force: Array, angle: Array) -> Array:
        """Normalised shear force F_sh = S / cos gamma [N/mm] of the clamp's force [N] at ``angle`` [rad], (n,) each."""
        return np.asarray(self.conjugate(force, angle) / np.cos(angle))


def strip_of(run: BiasExtensionRun) -> BiasStrip:
    """Strip of a run."""
    return BiasStrip(run.rig.gauge_length_mm, run.rig.width_mm)


def pin_jointed_force(run: Run, strip: BiasStrip, angle: Array) -> Array:
    """Force [N] at shear angles of the middle [rad], (n,)."""
    table = shear_table(run.fabric, shear_curve(run))

    def shear(at: Array) -> Array:
        return np.asarray(np.maximum(at[:, None] - table.knee, 0.0) @ table.slope)

    return strip.force(shear(angle), shear(0.5 * angle), angle)


# Shells of a strip on the bias are squares along the yarns, three kites in each triangle at an edge: lines between the
# zones are sides of shells, and pin-jointed yarns strain none of them.

#: corners of a diamond and of the triangles at the four edges about its place, in half diagonals
_SOUTH, _EAST, _NORTH, _WEST = (0, -1), (1, 0), (0, 1), (-1, 0)


def diamond_counts(length: float, width: float, size: float) -> tuple[int, int]:
    """Number of diamonds along and across; each is divided into four shells of about ``size`` [mm]."""
    diagonal = 2.0 * sqrt(2.0) * size
    across = max(round(width / diagonal), 2)
    return max(round(length * across / width), 2), across


def bias_mesh(length: float, width: float, size: float) -> tuple[Array, Index]:
    """Nodes (n, 3) [mm] of a strip about the origin, its length along y, and shells of about ``size`` (n_el, 4)."""
    along, across = diamond_counts(length, width, size)
    quads: list[list[tuple[float, float]]] = []
    for j in range(2 * along + 1):
        for i in range(1 - j % 2, 2 * across + 1, 2):
            quads += _diamond_shells(i, j, 2 * across, 2 * along)
    corners = np.array(quads)
    places, conn = np.unique(np.round(corners.reshape(-1, 2) * 12.0).astype(np.int64), axis=0, return_inverse=True)
    position = np.zeros((len(places), 3))
    position[:, 0] = width * (places[:, 0] / (24.0 * across) - 0.5)
    position[:, 1] = length * (places[:, 1] / (24.0 * along) - 0.5)
    return position, conn.reshape(-1, 4).astype(np.int64)


def _diamond_shells(i: int, j: int, right: int, top: int) -> list[list[tuple[float, float]]]:
    """Quadrilaterals of the diamond about (i, j), or of the half of it that lies in the strip."""
    corners = [(i + x, j + y) for x, y in (_SOUTH, _EAST, _NORTH, _WEST)]
    inside = [c for c in corners if 0 <= c[0] <= right and 0 <= c[1] <= top]
    if len(inside) < 3:
        return []
    if len(inside) == 3:  # in the order of a turn to the left
        first = next(k for k, c in enumerate(corners) if c not in inside)
        inside = [corners[(first + k) % 4] for k in (1, 2, 3)]
    centre = (sum(c[0] for c in inside) / len(inside), sum(c[1] for c in inside) / len(inside))
    middle = [(0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])) for a, b in zip(inside, inside[1:] + inside[:1], strict=True)]
    return [[middle[k - 1], corner, middle[k], centre] for k, corner in enumerate(inside)]


#: length of strip in each jaw over the diagonal of a cell, to grip every yarn; elements of the shortest inlay piece
JAW_CELLS, SHORTEST = 1.0, 4


@dataclass(frozen=True)
class Crossings:
    """Nodes at the start of the pitch of warp and of weft about each crossing, at it, and at the end, (n, 3) each.

    Of repeats of loops the place is the middle between both ends.
    """

    warp: Index
    weft: Index

    def angles(self, frame: Frame) -> Array:
        """Shear angle [rad] at each crossing, (n,), positive where the pull shears."""
        one, other = (frame.position[nodes[:, 2]] - frame.position[nodes[:, 0]] for nodes in (self.warp, self.weft))
        cosine = np.sum(one * other, axis=1) / np.linalg.norm(one, axis=1) / np.linalg.norm(other, axis=1)
        return np.asarray(np.arcsin(cosine))

    def places(self, frame: Frame) -> Array:
        """Place of each crossing, (n, 2) [mm]."""
        return np.asarray(0.5 * (_crossing_points(frame, self.warp) + _crossing_points(frame, self.weft)))

    def slip(self, start: Frame, frame: Frame) -> Array:
        """Way [mm] in the plane that the yarns of each crossing have moved against each other since ``start``, (n,)."""
        apart = [_crossing_points(one, self.warp) - _crossing_points(one, self.weft) for one in (start, frame)]
        return np.asarray(np.linalg.norm(apart[1] - apart[0], axis=1))


def _crossing_points(frame: Frame, nodes: Index) -> Array:
    """Place of a yarn at each crossing, (n, 2) [mm]."""
    return np.asarray(frame.position[nodes[:, 1], :2])


@dataclass(frozen=True)
class BiasYarns:
    """Pieces of yarn in strip and jaws, in the order of the chains, cut from ``piece`` of whole cells."""

    piece: YarnStrip
    paths: list[CutPath]
    n_wales: int
    n_courses: int

    def crossings(self, run: Run) -> Crossings:
        """Crossings of whole pitches of warp and weft in the strip; repeats of loops where inlays do not all cross."""
        if not has_all_crossings(run.fabric):
            return self._stitches(run)
        warp, weft = (full_layer(run.fabric, direction) for direction in DIRECTIONS)
        pitches = {warp: self.n_courses, weft: self.n_wales}
        found: dict[str, dict[tuple[int, int], tuple[int, int, int]]] = {system: {} for system in pitches}
        start = 0
        for path in self.paths:
            if path.system in pitches:
                number = pitches[path.system]
                step = (len(path.uncut_path.points) - 1) // number
                own = range(path.first, path.first + len(path.points))
                for k in range(number):
                    if k * step in own and (k + 1) * step in own:
                        place = (path.index, k) if path.system == warp else (k, path.index)
                        here = start + k * step - path.first
                        found[path.system][place] = (here, here + step // 2, here + step)  # an even number of beams
            start += len(path.points)
        both = sorted(found[warp].keys() & found[weft].keys())
        return Crossings(*(np.array([found[s][place] for place in both], np.int64).reshape(-1, 3) for s in pitches))

    def _stitches(self, run: Run) -> Crossings:
        """Repeats of loops: from a needle arc to those a repeat further along the wale and along the course."""
        arcs: dict[tuple[int, int], int] = {}
        start, step = 0, run.model.meso.elements_per_loop
        for path in self.paths:
            if path.system == KNIT:
                number = np.arange(path.first, path.first + len(path.points))
                arcs |= {(path.index, k // step): start + k - path.first for k in number[number % step == 0].tolist()}
            start += len(path.points)
        wales, courses = repeat_of(run.fabric.grid, run.fabric.inlays)
        ends = [
            (node, arcs[c + courses, w], arcs[c, w + wales])
            for (c, w), node in sorted(arcs.items())
            if (c + courses, w) in arcs and (c, w + wales) in arcs
        ]
        nodes = np.array(ends, np.int64).reshape(-1, 3)
        return Crossings(nodes[:, [0, 1, 1]], nodes[:, [0, 2, 2]])


def jaw_length(fabric: Fabric) -> float:
    """Length of strip inside each jaw [mm]."""
    return JAW_CELLS * sqrt(2.0) * max(fabric.wale_spacing, fabric.course_spacing)


def piece_counts(run: BiasExtensionRun) -> tuple[int, int]:
    """Wales and courses of the piece that the strip with its ends in the jaws is cut out of."""
    strip, fabric = strip_of(run), run.fabric
    length = strip.length + 2.0 * jaw_length(fabric)
    return cells_for_bias_strip(length, strip.width, (fabric.wale_spacing, fabric.course_spacing))


def cut_bias_yarns(
    run: BiasExtensionRun, strip: BiasStrip, specimen: int = 0, observer: Observer = SILENT
) -> BiasYarns:
    """Yarns of the strip, about the origin."""
    fabric, end = run.fabric, 0.5 * strip.length
    length = strip.length + 2.0 * jaw_length(fabric)
    pitches = fabric.wale_spacing, fabric.course_spacing
    n_wales, n_courses = piece_counts(run)
    piece = cut_piece(run, n_wales, n_courses, specimen, observer)
    paths = centre_paths(piece.paths, np.array([n_wales * pitches[0], n_courses * pitches[1]]))
    # one loop may stay: the rows beside it hold it
    shortest = dict.fromkeys(systems_of(fabric), SHORTEST) | {KNIT: run.model.meso.elements_per_loop}
    found = cut_on_the_bias(paths, length, strip.width, shortest)
    free = [path for path in found if np.abs(path.points[:, 1]).min() < end]  # the rest lies in a jaw
    return BiasYarns(piece, in_chain_order(run.fabric, free), n_wales, n_courses)
