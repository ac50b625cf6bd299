"""Report of the cantilever: the strip from the side with its board, plane and chord, and how it came to rest."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from knittest.base.figure import BLUE, GREY, ORANGE, dress, new_figure, save
from knittest.base.history import Array, Body, Specimen
from knittest.config.gates import HOURGLASS
from knittest.experiment.curves import ReferenceCurve
from knittest.experiment.tables import PublishedValue, for_width, with_note
from knittest.export.line_picture import Level, Line, line_picture
from knittest.laboratory.cantilever.config import CantileverRun
from knittest.laboratory.cantilever.corrections import EQ2
from knittest.laboratory.cantilever.test import MOMENT_TOLERANCE
from knittest.laboratory.cantilever.yarns import BALANCED
from knittest.laboratory.report_base import CurveAxes, Gate, NoSize, References, Report, energy_gate, title_of
from knittest.laboratory.strips import block
from knittest.materials.heavy_elastica import STANDARD_ANGLE, overhang_ratio

if TYPE_CHECKING:
    from matplotlib.axes import Axes


#: length and depth of the board over the overhang, and what is free around all
BOARD, DEEP, FREE = 0.3, 0.1, 0.05
WOOD, EDGE, SLOPE = "#d9c7ac", "#7a664a", "#f4eee3"
#: width of the picture, and what lies around its plane [inch]
WIDE, LEFT, RIGHT, TOP, BOTTOM = 7.6, 0.75, 0.25, 0.75, 0.6
#: line of an element of a yarn, and the least one of a sheet [points]
THREAD, SHEET = 0.8, 1.5


def side_picture(
    path: Path,
    along: Array,
    height: Array,
    segments: NDArray[np.int64],
    *,
    overhang: float,
    angle: float,
    plane: float,
    thickness: float,
    yarns: bool,
    title: str,
) -> None:
    """Elements seen from the side: ``along``, ``height`` (n_nodes,) [mm] from the edge, ``segments`` (n, 2)
    node numbers, of a sheet or of ``yarns``; ``thickness`` [mm] of the strip.

    ``plane`` is the angle [deg] of the plane through the edge, ``angle`` the chord's. Raises :class:`ResourceError`.
    """
    from matplotlib.collections import LineCollection

    reach, margin = float(along.max()), FREE * overhang
    drop = np.tan(np.deg2rad(plane)) * reach
    left, right = -BOARD * overhang - margin, reach + margin
    low, high = min(-drop, float(height.min())) - margin, 3.0 * margin
    scale = (WIDE - LEFT - RIGHT) / (right - left)
    tall = scale * (high - low)
    figure = new_figure(WIDE, tall + TOP + BOTTOM)
    whole = tall + TOP + BOTTOM
    axes = figure.add_axes((LEFT / WIDE, BOTTOM / whole, 1.0 - (LEFT + RIGHT) / WIDE, tall / whole))
    dress(axes)
    _board(axes, overhang, reach, drop, thickness)
    axes.plot([0.0, reach], [0.0, -drop], "--", color=ORANGE, linewidth=1.8, label=f"plane at {plane:g} deg")
    axes.plot(
        [0.0, reach], [0.0, -reach * np.tan(np.deg2rad(angle))], ":", color=GREY, linewidth=1.6,
        label=f"chord at {angle:.2f} deg",
    )  # fmt: skip
    width = THREAD if yarns else max(72.0 * scale * thickness, SHEET)
    points = np.stack([along, height], axis=1)
    drawn = LineCollection(list(points[segments]), colors=BLUE, linewidths=width, capstyle="butt", label="strip")
    axes.add_collection(drawn)
    arrow = {"arrowstyle": "<->", "color": GREY, "lw": 1.0, "shrinkA": 0.0, "shrinkB": 0.0}
    axes.annotate("", (0.0, 1.6 * margin), (reach, 1.6 * margin), arrowprops=arrow)
    axes.text(0.5 * reach, 1.75 * margin, f"overhang {overhang:.1f} mm along the strip", ha="center", fontsize=9)
    axes.set(xlim=(left, right), ylim=(low, high), xlabel="from the edge [mm]", ylabel="height [mm]")
    axes.set_title(f"{title}\nchord angle {angle:.2f} deg", loc="left", fontsize=11)
    axes.legend(loc="lower left", bbox_to_anchor=(0.05, 0.06), frameon=False, fontsize=9)
    save(figure, path)


def _board(axes: "Axes", overhang: float, reach: float, drop: float, thickness: float) -> None:
    """The board under the strip up to its edge, the slope below it, and the part of the strip that lies there."""
    from matplotlib.patches import Polygon, Rectangle

    half = 0.5 * thickness
    back, deep = -BOARD * overhang, DEEP * overhang
    slope = [[0.0, -half], [reach, -half - drop], [back, -half - drop], [back, -half]]
    axes.add_patch(Polygon(slope, facecolor=SLOPE, edgecolor="none", zorder=0.4))
    board = Rectangle((back, -half - deep), -back, deep, facecolor=WOOD, edgecolor=EDGE, zorder=0.6, label="board")
    axes.add_patch(board)
    lying = Rectangle((back, -half), -back, thickness, facecolor=BLUE, alpha=0.35, edgecolor="none", zorder=0.7)
    lying.set_label("strip on the board")
    axes.add_patch(lying)


#: bending stiffness per width [N mm], and that of a strip [mN cm2], which tables may have
PER_WIDTH, OF_A_STRIP = "bending_stiffness_n_mm_per_width", "bending_stiffness_mncm2"


def _residual(run: CantileverRun) -> str:
    if run.model.scale == "meso":
        return "deflection by moments out of balance / that by the weight"
    return "force out of balance / weight of the strip"


def _of(run: CantileverRun) -> str:
    return "of the deflection" if run.model.scale == "meso" else "of the weight"


def _tolerance(run: CantileverRun) -> float:
    return BALANCED if run.model.scale == "meso" else run.rig.tolerance


def _for_plane(row: PublishedValue, run: CantileverRun) -> PublishedValue:
    """An overhang, which tables have at 41.5 deg, at the plane that the run looks for, by the heavy elastica."""
    plane = run.rig.plane_angle
    if run.rig.mode != "overhang" or abs(plane - STANDARD_ANGLE) < 1e-9:
        return row
    ratio = overhang_ratio(plane, STANDARD_ANGLE)
    scaled = replace(row, mean=row.mean * ratio, sd=row.sd * ratio)
    return with_note(scaled, f"for a plane at {plane:g} instead of {STANDARD_ANGLE:g} deg")


def _per_width(row: PublishedValue) -> PublishedValue:
    """The bending stiffness of a strip [mN cm2] over its width [N mm]; raises :class:`InputError` without a width."""
    one = for_width(row, 1.0)
    per_width = replace(one, quantity=PER_WIDTH, mean=0.1 * one.mean, sd=0.1 * one.sd, unit="N mm")
    return with_note(replace(per_width, table=row.table, scaled=row.scaled), "that of the strip over its width")


class CantileverReport(NoSize[CantileverRun], Report[CantileverRun]):
    """See :class:`knittest.laboratory.report_base.Report`."""

    axes = CurveAxes("steps", "residual", "relaxation steps", "out of balance [-]", logarithmic=True)

    def levels(self, run: CantileverRun) -> list[Level]:
        """Residual below which the strip is at rest."""
        return [Level(_tolerance(run), "at rest: out of balance by less")]

    def gates(self, run: CantileverRun) -> list[Gate]:
        """Rest, the root carries the weight, and hourglass control little of the energy."""
        return [
            Gate("residual at rest", "results", "residual", _tolerance(run), unit=_of(run)),
            Gate("root moment off weight", "results", "moment_error_pct", 100.0 * MOMENT_TOLERANCE),
            *(energy_gate(run, gate) for gate in (HOURGLASS,) if gate.applies(run)),
        ]

    def scaled(self, run: CantileverRun, rows: Sequence[PublishedValue]) -> list[PublishedValue]:
        """Overhangs for the plane of the run, and the bending stiffness per width, which a table may have as that of a
        strip, beside both of the run: by Eq. 2, as the tested one, and at the root.
        """
        per_width = {row.quantity: row for row in rows}.get(PER_WIDTH)
        found = [_for_plane(row, run) for row in rows if row.quantity == "overhang_mm"]
        for row in rows if per_width is None else [per_width]:
            if row.quantity in (PER_WIDTH, OF_A_STRIP):
                one = row if row is per_width else _per_width(row)
                found += [replace(one, quantity=EQ2), one]
        return found

    def reference_curve(self, run: CantileverRun) -> ReferenceCurve | None:
        """No curve is published."""
        return None

    def placed(self, run: CantileverRun, specimen: Specimen) -> list[Body]:
        """The board up to its edge, and the plane that the strip is to meet."""
        history = specimen.history
        first, last = history.frames[0].position, history.frames[-1].position
        top = float(first[:, 2].mean()) - 0.5 * run.fabric.thickness_mm
        sides = float(first[:, 0].min()), float(first[:, 0].max())
        reach = float(last[:, 1].max())
        back, deep = BOARD * specimen.results["overhang_mm"], DEEP * specimen.results["overhang_mm"]
        foot = top - reach * np.tan(np.deg2rad(run.rig.plane_angle))
        board = np.array([[-back, top - deep], [0.0, top - deep], [0.0, top], [-back, top]])
        slope = np.array([[0.0, top], [0.0, foot], [reach, foot]])
        still = np.zeros((len(history.frames), 3))
        return [block("board", board, sides, still), block("plane", slope, sides, still)]

    def pictures(self, run: CantileverRun, specimens: list[Specimen], references: References, folder: Path) -> None:
        """deformed.png from the side, curve.png of the convergence."""
        history, results = specimens[0].history, specimens[0].results
        curve = history.curve
        moves = curve["largest_move_mm"] / max(float(curve["largest_move_mm"].max()), 1e-12)
        lines = [
            Line(curve["steps"], curve["residual"], _residual(run)),
            Line(curve["steps"], moves, "movement / fastest movement"),
        ]
        line_picture(
            folder / "curve.png", lines, title=f"{title_of(run)}: coming to rest", xlabel=self.axes.xlabel,
            ylabel="ratio [-]", levels=self.levels(run), logarithmic=True,
        )  # fmt: skip
        first, last = history.frames[0].position, history.frames[-1].position
        cells = history.mesh.cells
        segments = cells if cells.shape[1] == 2 else np.vstack([cells[:, [0, 3]], cells[:, [1, 2]]])
        side_picture(
            folder / "deformed.png", last[:, 1], last[:, 2] - float(first[:, 2].mean()), segments,
            overhang=results["overhang_mm"], angle=results["chord_angle_deg"], plane=run.rig.plane_angle,
            title=title_of(run), thickness=run.fabric.thickness_mm, yarns=history.mesh.kind == "beams",
        )  # fmt: skip
