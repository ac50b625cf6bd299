"""Report of the cantilever: the strip from the side with its board, plane and chord, and how it came to rest."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from knittest.base.figure import BLUE, GREY, ORANGE, new_figure, save, style_axes
from knittest.base.history import Array, Body, Specimen
from knittest.config.quality_checks import HOURGLASS
from knittest.experiment.tables import PublishedValue, scale_to_width, with_note
from knittest.export.line_picture import Level, Line
from knittest.laboratory.cantilever.config import CantileverRun
from knittest.laboratory.cantilever.corrections import EQ2
from knittest.laboratory.cantilever.meso_strip import BALANCED
from knittest.laboratory.cantilever.test import MOMENT_TOLERANCE
from knittest.laboratory.report_base import (
    CurveAxes,
    FabricReport,
    QualityCheck,
    References,
    SizeFreeReport,
    energy_check,
    title_of,
)
from knittest.laboratory.strips import make_block
from knittest.materials.heavy_elastica import STANDARD_ANGLE, overhang_ratio

if TYPE_CHECKING:
    from matplotlib.axes import Axes


#: length and depth of the board, and free margin, over the overhang
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
    """Draw nodes ``along``, ``height`` (n,) [mm] and ``segments`` (n, 2) with plane and chord, from the side."""
    from matplotlib.collections import LineCollection

    reach, margin = float(along.max()), FREE * overhang
    drop = np.tan(np.deg2rad(plane)) * reach
    left, right = -BOARD * overhang - margin, reach + margin
    low, high = min(-drop, float(height.min())) - margin, 3.0 * margin
    scale = (WIDE - LEFT - RIGHT) / (right - left)
    tall = scale * (high - low)
    whole = tall + TOP + BOTTOM
    figure = new_figure(WIDE, whole)
    axes = figure.add_axes((LEFT / WIDE, BOTTOM / whole, 1.0 - (LEFT + RIGHT) / WIDE, tall / whole))
    style_axes(axes)
    _draw_board(axes, overhang, reach, drop, thickness)
    axes.plot([0.0, reach], [0.0, -drop], "--", color=ORANGE, linewidth=1.8, label=f"plane at {plane:g} deg")
    tip = -reach * np.tan(np.deg2rad(angle))
    axes.plot([0.0, reach], [0.0, tip], ":", color=GREY, linewidth=1.6, label=f"chord at {angle:.2f} deg")
    width = THREAD if yarns else max(72.0 * scale * thickness, SHEET)
    lines = list(np.stack([along, height], axis=1)[segments])
    axes.add_collection(LineCollection(lines, colors=BLUE, linewidths=width, capstyle="butt", label="strip"))
    arrow = {"arrowstyle": "<->", "color": GREY, "lw": 1.0, "shrinkA": 0.0, "shrinkB": 0.0}
    axes.annotate("", (0.0, 1.6 * margin), (reach, 1.6 * margin), arrowprops=arrow)
    axes.text(0.5 * reach, 1.75 * margin, f"overhang {overhang:.1f} mm along the strip", ha="center", fontsize=9)
    axes.set(xlim=(left, right), ylim=(low, high), xlabel="from the edge [mm]", ylabel="height [mm]")
    axes.set_title(f"{title}\nchord angle {angle:.2f} deg", loc="left", fontsize=11)
    axes.legend(loc="lower left", bbox_to_anchor=(0.05, 0.06), frameon=False, fontsize=9)
    save(figure, path)


def _draw_board(axes: "Axes", overhang: float, reach: float, drop: float, thickness: float) -> None:
    """Draw the board up to its edge, the slope below it, and the part of the strip that lies there."""
    from matplotlib.patches import Polygon, Rectangle

    half, back, deep = 0.5 * thickness, -BOARD * overhang, DEEP * overhang
    slope = [[0.0, -half], [reach, -half - drop], [back, -half - drop], [back, -half]]
    board: Any = {"facecolor": WOOD, "edgecolor": EDGE, "zorder": 0.6, "label": "board"}
    strip: Any = {"facecolor": BLUE, "alpha": 0.35, "edgecolor": "none", "zorder": 0.7, "label": "strip on the board"}
    axes.add_patch(Polygon(slope, facecolor=SLOPE, edgecolor="none", zorder=0.4))
    axes.add_patch(Rectangle((back, -half - deep), -back, deep, **board))
    axes.add_patch(Rectangle((back, -half), -back, thickness, **strip))


#: bending stiffness per width [N mm], and that of a strip [mN cm2], which tables may have
PER_WIDTH, OF_A_STRIP = "bending_stiffness_n_mm_per_width", "bending_stiffness_mncm2"


def _tolerance(run: CantileverRun) -> float:
    return BALANCED if run.model.scale == "meso" else run.rig.tolerance


def _convert_to_plane(row: PublishedValue, run: CantileverRun) -> PublishedValue:
    """Convert an overhang at 41.5 deg to the plane of the run, by the heavy elastica."""
    plane = run.rig.plane_angle
    if run.rig.mode != "overhang" or abs(plane - STANDARD_ANGLE) < 1e-9:
        return row
    ratio = overhang_ratio(plane, STANDARD_ANGLE)
    scaled = replace(row, mean=row.mean * ratio, sd=row.sd * ratio)
    return with_note(scaled, f"for a plane at {plane:g} instead of {STANDARD_ANGLE:g} deg")


class CantileverReport(SizeFreeReport[CantileverRun], FabricReport[CantileverRun]):
    """See :class:`knittest.laboratory.report_base.Report`."""

    axes = CurveAxes("steps", "residual", "relaxation steps", "residual [-]", logarithmic=True)

    def levels(self, run: CantileverRun) -> list[Level]:
        """Residual of equilibrium."""
        return [Level(_tolerance(run), "equilibrium: smaller residual")]

    def quality_checks(self, run: CantileverRun) -> list[QualityCheck]:
        """Limits of residual, root moment, and hourglass energy."""
        unit = "of the deflection" if run.model.scale == "meso" else "of the weight"
        return [
            QualityCheck("residual at rest", "results", "residual", _tolerance(run), unit=unit),
            QualityCheck("root moment off weight", "results", "moment_error_pct", 100.0 * MOMENT_TOLERANCE),
            *(energy_check(run, check) for check in (HOURGLASS,) if check.applies(run)),
        ]

    def scaled(self, run: CantileverRun, rows: Sequence[PublishedValue]) -> list[PublishedValue]:
        """Overhangs for the plane of the run, and the bending stiffness per width for Eq. 2 and for the root."""
        per_width = {row.quantity: row for row in rows}.get(PER_WIDTH)
        found = [_convert_to_plane(row, run) for row in rows if row.quantity == "overhang_mm"]
        for row in rows if per_width is None else [per_width]:
            if row.quantity in (PER_WIDTH, OF_A_STRIP):
                one = row
                if row is not per_width:  # of a strip [mN cm2]
                    each = scale_to_width(row, 1.0)
                    each = replace(each, quantity=PER_WIDTH, mean=0.1 * each.mean, sd=0.1 * each.sd, unit="N mm")
                    each = replace(each, table=row.table, scaled=row.scaled)
                    one = with_note(each, "that of the strip over its width")
                found += [replace(one, quantity=EQ2), one]
        return found

    def placed(self, run: CantileverRun, specimen: Specimen) -> list[Body]:
        """The board up to its edge, and the plane."""
        history = specimen.history
        first, last = history.frames[0].position, history.frames[-1].position
        top = float(first[:, 2].mean()) - 0.5 * run.fabric.thickness_mm
        sides = float(first[:, 0].min()), float(first[:, 0].max())
        reach, overhang = float(last[:, 1].max()), specimen.results["overhang_mm"]
        back, deep = BOARD * overhang, DEEP * overhang
        foot = top - reach * np.tan(np.deg2rad(run.rig.plane_angle))
        board = np.array([[-back, top - deep], [0.0, top - deep], [0.0, top], [-back, top]])
        slope = np.array([[0.0, top], [0.0, foot], [reach, foot]])
        still = np.zeros((len(history.frames), 3))
        return [make_block("board", board, sides, still), make_block("plane", slope, sides, still)]

    def pictures(self, run: CantileverRun, specimens: list[Specimen], references: References, folder: Path) -> None:
        """Draw deformed.png from the side, and curve.png of the convergence."""
        history, results = specimens[0].history, specimens[0].results
        curve, meso = history.curve, run.model.scale == "meso"
        residual = "deflection by unbalanced moments / by weight" if meso else "unbalanced force / weight of the strip"
        moves = curve["largest_move_mm"] / max(float(curve["largest_move_mm"].max()), 1e-12)
        lines = [
            Line(curve["steps"], curve["residual"], residual),
            Line(curve["steps"], moves, "movement / fastest movement"),
        ]
        title = f"{title_of(run)}: convergence"
        self.draw_lines(
            run, lines, References(), folder / "curve.png", title=title, ylabel="ratio [-]", logarithmic=True
        )
        first, last = history.frames[0].position, history.frames[-1].position
        cells = history.mesh.cells
        segments = cells if cells.shape[1] == 2 else np.vstack([cells[:, [0, 3]], cells[:, [1, 2]]])
        side_picture(
            folder / "deformed.png", last[:, 1], last[:, 2] - float(first[:, 2].mean()), segments,
            overhang=results["overhang_mm"], angle=results["chord_angle_deg"], plane=run.rig.plane_angle,
            title=title_of(run), thickness=run.fabric.thickness_mm, yarns=history.mesh.kind == "beams",
        )  # fmt: skip
