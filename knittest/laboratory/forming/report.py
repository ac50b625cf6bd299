"""Report of a forming test: forces over the stroke, shear angles, wrinkles, draw-in, yarn forces."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from knittest.base.history import Array, Body, Specimen
from knittest.export.line_picture import Level, Line, line_picture
from knittest.laboratory.forming.config import FormingRun
from knittest.laboratory.forming.pictures import Field, Outlines, outline_picture, plan_picture, tilted_picture
from knittest.laboratory.forming.results import MECHANISMS, MidSurface, draw_in, stamp_work, yarn_forces
from knittest.laboratory.forming.test import WRINKLE_HEIGHT, allowed_depth, mid_surface_at, shear_field
from knittest.laboratory.forming.tool_check import moved_tools, tools_of
from knittest.laboratory.report_base import (
    Columns,
    CurveAxes,
    FabricReport,
    QualityCheck,
    References,
    SizeFreeReport,
    title_of,
)

#: share of the elements within the colours [%], least share of the work of a mechanism, picture over the blank's side
SHOWN, DRAWN, AROUND = 99.5, 0.01, 1.06
#: lines of one colour in a picture of mechanisms
STYLES = ("-", "--", "-.", ":")


class FormingReport(SizeFreeReport[FormingRun], FabricReport[FormingRun]):
    """See :class:`knittest.laboratory.report_base.Report`."""

    axes = CurveAxes("stamp_travel_mm", "stamp_force_n", "travel of the stamp [mm]", "force [N]")
    placement_facts = ("thickness_mm",)

    def levels(self, run: FormingRun) -> list[Level]:
        """Force on the holder."""
        force = run.rig.blank_holder_force
        return [Level(force, f"force on the blank holder: {force:g} N")] if force > 0.0 else []

    def quality_checks(self, run: FormingRun) -> list[QualityCheck]:
        """Standard checks, and the penetration of tools."""
        limit = allowed_depth(run)
        depth = QualityCheck("deepest penetration of a tool", "results", "tool_penetration_max_um", limit, unit="um")
        return [*super().quality_checks(run), depth]

    def tables(self, run: FormingRun, specimens: list[Specimen]) -> dict[str, Columns]:
        """draw-in.csv, yarn-forces.csv, shear-field.csv, height-field.csv and stamp-work.csv of the first specimen."""
        history, surface = specimens[0].history, _surface(run, specimens[0])
        angle, place = shear_field(run, history.mesh, history.frames[-1])
        return {
            "draw-in.csv": draw_in(history.mesh, history.frames[0], history.frames[-1]).table(),
            "yarn-forces.csv": yarn_forces(run, history.mesh, history.frames),
            "stamp-work.csv": stamp_work(history),
            "shear-field.csv": {"x_mm": place[:, 0], "y_mm": place[:, 1], "shear_angle_deg": angle},
            "height-field.csv": {
                "start_x_mm": surface.start[:, 0], "start_y_mm": surface.start[:, 1], "x_mm": surface.now[:, 0],
                "y_mm": surface.now[:, 1], "z_mm": surface.now[:, 2], "height_mm": surface.height,
            },
        }  # fmt: skip

    def placed(self, run: FormingRun, specimen: Specimen) -> list[Body]:
        """Stamp, die and holder."""
        return moved_tools(tools_of(run, specimen.facts["thickness_mm"]), specimen.history)

    def draw_specimen(self, run: FormingRun, specimen: Specimen, folder: Path) -> None:
        """Draw deformed.png, shear-angle.png, wrinkles.png, draw-in.png, yarn-forces.png and stamp-work.png."""
        history, surface, title = specimen.history, _surface(run, specimen), title_of(run)
        last, results, outlines = history.frames[-1], specimen.results, _outlines(run, specimen)
        value, label = np.abs(np.rad2deg(last.fields.get("shear_angle", 0.0))), "shear angle, without its sign [deg]"
        if history.mesh.kind == "beams":
            value, label = np.maximum(last.fields["axial_force"], 0.0), "tension of the yarn [N]"
        tilted_picture(
            folder / "deformed.png", history.mesh, last, value, title=f"{title}, formed {last.coordinate:.0f} mm",
            label=label, top=float(np.percentile(value, SHOWN)),
        )  # fmt: skip
        angle, place = shear_field(run, history.mesh, last)
        cells = last.position[history.mesh.cells][:, :, :2] if history.mesh.kind == "shells" else None
        plan_picture(
            folder / "shear-angle.png", Field(place, angle, cells), outlines, title=title, signed=True,
            label="shear angle of the material [deg]", top=float(np.percentile(np.abs(angle), SHOWN)),
            note=f"at {last.coordinate:.1f} mm: largest {results['max_shear_angle_deg']:.1f} deg",
        )  # fmt: skip
        flange = np.where(surface.on_die, surface.height, np.nan)
        height = flange if cells is None else flange[history.mesh.cells].mean(axis=1)
        high = WRINKLE_HEIGHT * specimen.facts["thickness_mm"]
        raised = Field(surface.now[:, :2], height, cells, "walls and bottom, not evaluated", "YlOrRd", high)
        plan_picture(
            folder / "wrinkles.png", raised, outlines, title=title,
            label=f"height of the flange above the die [mm]; line: {high:.2g} mm, wrinkled above",
            top=max(float(np.percentile(np.append(surface.flange_heights, 0.0), SHOWN)), 2.0 * high),
            note=f"flange: largest {results['max_wrinkle_height_mm']:.2f} mm, {results['wrinkled_area_pct']:.1f} % "
            f"above half the thickness; bottom: {results['off_stamp_area_pct']:.1f} % as far off the stamp",
        )  # fmt: skip
        edge = draw_in(history.mesh, history.frames[0], last)
        outline_picture(
            folder / "draw-in.png", [edge.now[edge.side == k] for k in dict.fromkeys(edge.side.tolist())], outlines,
            title=title,
            note=f"largest {edge.drawn.max():.1f} mm; middle of the sides: {results['draw_in_warp_mm']:.1f} mm "
            f"along the warp, {results['draw_in_weft_mm']:.1f} mm along the weft",
        )  # fmt: skip
        _draw_ranking(run, yarn_forces(run, history.mesh, history.frames), title, folder / "yarn-forces.png")
        _draw_work(stamp_work(history), title, folder / "stamp-work.png")

    def draw_curve(self, run: FormingRun, specimens: list[Specimen], references: References, path: Path) -> None:
        """Draw the forces of stamp and holder."""
        lines = []
        for k, specimen in enumerate(specimens):
            curve = specimen.history.curve
            lines.append(Line(curve[self.axes.x], _smooth(curve["stamp_force_n"]), f"stamp, specimen {k + 1}"))
            if "holder_force_n" in curve:
                drawing = curve[self.axes.x] > 0.0  # pressed on before
                travel, force = curve[self.axes.x][drawing], _smooth(curve["holder_force_n"])[drawing]
                lines.append(Line(travel, force, f"holder, specimen {k + 1}", "-."))
        self.draw_lines(run, lines, References(), path)


def _surface(run: FormingRun, specimen: Specimen) -> MidSurface:
    return mid_surface_at(run, specimen.facts, specimen.history, specimen.history.frames[-1])


def _outlines(run: FormingRun, specimen: Specimen) -> Outlines:
    thickness = specimen.facts["thickness_mm"]
    tools, start = tools_of(run, thickness), specimen.history.frames[0].position
    half = np.abs(start[:, :2]).max(axis=0)
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1], [-1, -1]]) * half
    depth = run.rig.depth
    return Outlines(
        {
            "flat blank": corners,
            "stamp": _section(tools.stamp.distance, 0.5 * thickness + depth, half),
            "opening of the die": _section(tools.die.distance, -0.5 * thickness - depth, half),
        },
        (AROUND * half[0], AROUND * half[1]),
    )


def _section(distance: Callable[[Array], Array], height: float, half: Array) -> Array:
    """Longest section line of a tool at ``height`` [mm], (n, 2)."""
    from contourpy import contour_generator

    x, y = np.meshgrid(*(np.linspace(-h, h, 300) for h in half))
    points = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, height)])
    lines: list[Array] = list(contour_generator(x, y, distance(points).reshape(x.shape)).lines(0.0))  # type: ignore[arg-type]
    return max(lines, key=len, default=np.zeros((0, 2)))


def _smooth(force: Array) -> Array:
    """Mean over a hundredth of the stroke, without the blows of single nodes."""
    from scipy.ndimage import uniform_filter1d

    return np.asarray(uniform_filter1d(force, max(len(force) // 100, 1)))


def _draw_ranking(run: FormingRun, table: dict[str, Array], title: str, path: Path) -> None:
    lines, risk = [], run.rig.risk_share
    for system in dict.fromkeys(table["system"].tolist()):
        share = table["utilisation_pct"][table["system"] == system]
        lines.append(Line(np.arange(1, len(share) + 1.0), share, system))
    first = zip(table["system"][:3], table["yarn"][:3], table["force_n"][:3], strict=True)
    worst = ", ".join(f"{system} {number} ({force:.1f} N)" for system, number, force in first)
    near = table["utilisation_pct"].max() > 30.0 * risk
    line_picture(
        path, lines, title=f"{title}\nmost loaded: {worst}", xlabel="yarns of a system, the most loaded first",
        ylabel="largest tension over strength [%]",
        levels=[Level(100.0 * risk, "at risk (rig.risk_share)")] if near else [],
    )  # fmt: skip


def _draw_work(table: dict[str, Array], title: str, path: Path) -> None:
    travel, stamp = table["stamp_travel_mm"], table["stamp_mj"]
    total = max(float(np.abs(stamp + table["holder_and_weight_mj"]).max()), np.finfo(float).tiny)
    labels = {"holder_and_weight": "work of holder and weight"} | {name: row[0] for name, row in MECHANISMS.items()}
    found = [(label, table[f"{name}_mj"]) for name, label in labels.items() if f"{name}_mj" in table]
    found = sorted((f for f in found if np.abs(f[1]).max() >= DRAWN * total), key=lambda f: -float(f[1][-1]))
    lines = [Line(travel, stamp, "work of the stamp")]
    lines += [
        Line(travel, energy, f"{label}, {100.0 * energy[-1] / total:.1f} %", STYLES[k // 5])
        for k, (label, energy) in enumerate(found, 1)
    ]
    ylabel = "energy [mJ] (legend: share of all work at the end)"
    line_picture(path, lines, title=title, xlabel="travel of the stamp [mm]", ylabel=ylabel)
