"""Tools of a forming run: their STL files, whether they fit each other, and where they are in each frame."""

from dataclasses import dataclass
from math import ceil
from pathlib import Path
from typing import Any

from knittest.base.errors import InputError
from knittest.base.files import replace_file, resource_error
from knittest.base.history import Body, History
from knittest.laboratory.forming.config import FormingRun
from knittest.laboratory.strips import offsets
from knittest.tooling.fit import Fit, Stroke, measure_fit, plan_problems
from knittest.tooling.tool_corrections import fitting_change
from knittest.tooling.toolset import ToolSet, build_tools


@dataclass(frozen=True)
class CheckedTools:
    """Tools with their ``fit``; ``lines`` state it for a user."""

    tools: ToolSet
    fit: Fit

    @property
    def lines(self) -> list[str]:
        """Depth, clearances and warnings."""
        fit = self.fit
        found = [
            f"stamp enters the die's opening by {fit.depth:.3g} mm of {fit.asked:g} mm",
            f"smallest clearance of stamp and die {fit.die.size:.3g} mm (fabric {fit.thickness:.3g} mm)",
            f"  {fit.die.place_text}",
        ]
        if fit.holder is not None:
            found.append(f"smallest clearance of stamp and holder {fit.holder.size:.3g} mm")
        return [*found, *(f"warning: {text}" for text in fit.fit_warnings)]

    def as_json(self) -> dict[str, Any]:
        """Numbers for a program."""
        fit, holder = self.fit, None if self.fit.holder is None else self.fit.holder.size
        return {
            "depth_mm": fit.depth, "depth_asked_mm": fit.asked, "thickness_mm": fit.thickness,
            "clearance_mm": fit.die.size, "clearance_at_mm": fit.die.place, "clearance_travel_mm": fit.die.travel,
            "holder_clearance_mm": holder,
        }  # fmt: skip


def tools_of(run: FormingRun, thickness: float) -> ToolSet:
    """Tools of ``run`` about a blank of ``thickness`` [mm]."""
    rig = run.rig
    holder, blank = rig.holder if rig.blank_holder_force > 0.0 else None, (rig.blank_width_mm, rig.blank_length_mm)
    return build_tools(rig.stamp, rig.die, holder, rig.depth_mm, thickness, blank)


def measured_tools(run: FormingRun, thickness: float) -> CheckedTools:
    """Tools of ``run`` with their fit, good or not; raises :class:`InputError` without distances."""
    tools, stroke = tools_of(run, thickness), stroke_of(run, thickness)
    try:
        return CheckedTools(tools, measure_fit(tools, stroke))
    except InputError as error:
        if problems := plan_problems(tools, stroke):
            raise InputError(_misfit_message(run, tools, stroke, [f"{error}.", *problems])) from None
        raise


def fitting_tools(run: FormingRun, thickness: float) -> CheckedTools:
    """Tools of ``run``; raises :class:`InputError` where they do not fit, with a remedy."""
    found = measured_tools(run, thickness)
    check_tool_fit(run, found)
    return found


def check_tool_fit(run: FormingRun, found: CheckedTools) -> None:
    """Raise :class:`InputError` for tools of ``run`` that do not fit, with a remedy."""
    fit = found.fit
    if not fit.problems:
        return
    problems, short = list(fit.problems), {"die": fit.thickness - fit.die.size}
    if fit.holder is not None:
        short["holder"] = -fit.holder.size
    for name, missing in short.items():
        opening = getattr(run.rig, name)
        if opening.stl is None and missing > 0.0:
            enough = ceil(10.0 * (opening.clearance + missing)) / 10.0
            problems.append(f"Set rig.{name}.clearance to at least {enough:.1f} mm.")
    raise InputError(_misfit_message(run, found.tools, stroke_of(run, fit.thickness), problems))


def _misfit_message(run: FormingRun, tools: ToolSet, stroke: Stroke, problems: list[str]) -> str:
    files = {name: tool.stl.path for name, tool in tools.by_name.items() if tool.stl is not None}
    what = ", ".join(f"rig.{name}.stl.path = {path}" for name, path in files.items()) or "rig.stamp, rig.die"
    parts = [f"{what}: the tools do not fit each other.", *problems]
    change = fitting_change(tools, stroke) if files else None
    if change is not None:
        parts.append("The tools fit with " + " ".join(f"--set {setting}" for setting in change.settings) + ".")
    elif files:
        parts.append(
            "No rotation by 90 or 180 degrees, no move to the middle of the blank and no unit makes them fit. Expected "
            "z up, x along the weft and y along the warp."
        )
    return " ".join(parts)


def stroke_of(run: FormingRun, thickness: float) -> Stroke:
    """Stroke of the tools of ``run`` on a blank of ``thickness`` [mm]."""
    return Stroke(run.rig.depth_mm, thickness, (run.rig.blank_width_mm, run.rig.blank_length_mm))


def check_tools(run: FormingRun, folder: Path) -> tuple[list[str], dict[str, Any]]:
    """Check and draw the tools of ``run`` for ``knittest check``; raises :class:`InputError` where they do not fit."""
    from knittest.base.figure import Stamp, use_stamp
    from knittest.base.files import make_folder
    from knittest.laboratory.forming.pictures import tools_picture
    from knittest.laboratory.report_base import size_of

    thickness = run.fabric.thickness_mm
    found = measured_tools(run, thickness)
    make_folder(folder)
    path = folder / "tools.png"
    title = "Tools of forming" + (", which do not fit each other" if found.fit.problems else "")
    with use_stamp(Stamp((f"for {run.fabric.name}, {thickness:g} mm thick", *size_of(run)))):
        tools_picture(path, found.tools, found.fit, stroke_of(run, thickness), title=title)
    try:
        check_tool_fit(run, found)
    except InputError as error:
        raise InputError(f"{error} Section: {path}") from None
    return [*found.lines, f"section: {path}"], {**found.as_json(), "picture": str(path)}


def write_tools(tools: ToolSet, folder: Path) -> list[Path]:
    """Write stamp.stl, die.stl and holder.stl (binary, mm), where they start. Raises :class:`ResourceError`."""
    import meshio

    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise resource_error(folder, error) from error
    paths = []
    for name, tool in tools.by_name.items():
        mesh = meshio.Mesh(tool.solid.points, [("triangle", tool.solid.triangles)])
        paths.append(folder / f"{name}.stl")
        with replace_file(paths[-1]) as temporary:
            meshio.write(temporary, mesh, file_format="stl", binary=True)
    return paths


#: column of the curve with the travel of a tool [mm], and which way along z it counts; the die stays
TRAVEL = {"stamp": ("stamp_travel_mm", -1.0), "holder": ("holder_travel_mm", 1.0)}


def moved_tools(tools: ToolSet, history: History) -> list[Body]:
    """Meshes of ``tools``, moved by their travel in each frame."""
    found = []
    for name, tool in tools.by_name.items():
        column, way = TRAVEL.get(name, ("", 1.0))
        offset = offsets(history, {2: column} if column else {}, way)
        found.append(Body(name, tool.solid.points, tool.solid.triangles, offset))
    return found
