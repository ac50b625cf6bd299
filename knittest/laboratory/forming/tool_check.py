"""Tools of a forming run: their STL files, whether they fit each other, and where they are in each frame."""

from dataclasses import dataclass
from math import ceil
from pathlib import Path
from typing import Any

import numpy as np

from knittest.base.errors import InputError
from knittest.base.files import replacing, resource_error
from knittest.base.history import Body, History
from knittest.laboratory.forming.config import FormingRun
from knittest.laboratory.strips import at_frames
from knittest.tooling.fit import Fit, Stroke, measure_fit, plan_problems
from knittest.tooling.refit import fitting_change
from knittest.tooling.toolset import ToolSet, build_tools


@dataclass(frozen=True)
class CheckedTools:
    """Tools with their ``fit``; ``lines`` state it for a user."""

    tools: ToolSet
    fit: Fit

    @property
    def lines(self) -> list[str]:
        """Depth, clearances and what is suspicious."""
        fit = self.fit
        found = [
            f"stamp enters the die's opening by {fit.depth:.3g} mm of {fit.asked:g} mm",
            f"smallest clearance of stamp and die {fit.die.size:.3g} mm (fabric {fit.thickness:.3g} mm)",
            f"  {fit.die.where}",
        ]
        if fit.holder is not None:
            found.append(f"smallest clearance of stamp and holder {fit.holder.size:.3g} mm")
        return [*found, *(f"warning: {text}" for text in fit.doubts)]

    def as_json(self) -> dict[str, Any]:
        """The numbers, for a program."""
        fit = self.fit
        holder = None if fit.holder is None else fit.holder.size
        return {
            "depth_mm": fit.depth, "depth_asked_mm": fit.asked, "thickness_mm": fit.thickness,
            "clearance_mm": fit.die.size, "clearance_at_mm": fit.die.place, "clearance_travel_mm": fit.die.travel,
            "holder_clearance_mm": holder,
        }  # fmt: skip


def tools_of(run: FormingRun, thickness: float) -> ToolSet:
    """The tools of ``run`` about a blank of ``thickness`` [mm]."""
    rig = run.rig
    holder = rig.holder if rig.blank_holder_force > 0.0 else None
    blank = (rig.blank_width_mm, rig.blank_length_mm)
    return build_tools(rig.stamp, rig.die, holder, rig.depth_mm, thickness, blank)


def measured_tools(run: FormingRun, thickness: float) -> CheckedTools:
    """The tools of ``run`` with their fit, whether they fit or not; raises :class:`InputError` without distances."""
    tools, stroke = tools_of(run, thickness), stroke_of(run, thickness)
    try:
        return CheckedTools(tools, measure_fit(tools, stroke))
    except InputError as error:
        if problems := plan_problems(tools, stroke):
            raise InputError(_misfits(run, tools, stroke, [f"{error}.", *problems])) from None
        raise


def fitting_tools(run: FormingRun, thickness: float) -> CheckedTools:
    """The tools of ``run``; raises :class:`InputError` where they do not fit, with what would make them fit."""
    found = measured_tools(run, thickness)
    refuse_misfits(run, found)
    return found


def refuse_misfits(run: FormingRun, found: CheckedTools) -> None:
    """Raise :class:`InputError` for tools of ``run`` that do not fit, with what would make them fit."""
    fit = found.fit
    if fit.problems:
        problems = [*fit.problems, *_wider(run, fit)]
        raise InputError(_misfits(run, found.tools, stroke_of(run, fit.thickness), problems))


def _misfits(run: FormingRun, tools: ToolSet, stroke: Stroke, problems: list[str]) -> str:
    """The ``problems`` of ``tools``, with the change of files that makes them fit."""
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


def _wider(run: FormingRun, fit: Fit) -> list[str]:
    """Advice on the clearance of openings by dimensions."""
    found = []
    for name, missing in (
        ("die", fit.thickness - fit.die.size), ("holder", 0.0 if fit.holder is None else -fit.holder.size),
    ):  # fmt: skip
        opening = getattr(run.rig, name)
        if opening.stl is None and missing > 0.0:
            enough = ceil(10.0 * (opening.clearance + missing)) / 10.0
            found.append(f"Set rig.{name}.clearance to at least {enough:.1f} mm.")
    return found


def stroke_of(run: FormingRun, thickness: float) -> Stroke:
    """Stroke of the tools of ``run`` on a blank of ``thickness`` [mm]."""
    return Stroke(run.rig.depth_mm, thickness, (run.rig.blank_width_mm, run.rig.blank_length_mm))


def check_tools(run: FormingRun, folder: Path) -> tuple[list[str], dict[str, Any]]:
    """Lines and numbers of ``knittest check`` on the tools of ``run``; draws them to tools.png in ``folder``.

    Raises :class:`InputError` for tools that do not fit, after they are drawn.
    """
    from knittest.base.figure import Stamp, stamped
    from knittest.base.files import make_folder
    from knittest.laboratory.forming.pictures import tools_picture
    from knittest.laboratory.report_base import size_of

    thickness = run.fabric.thickness_mm
    found = measured_tools(run, thickness)
    make_folder(folder)
    path = folder / "tools.png"
    title = "Tools of forming" + (", which do not fit each other" if found.fit.problems else "")
    with stamped(Stamp((f"for {run.fabric.name}, {thickness:g} mm thick", *size_of(run)))):
        tools_picture(path, found.tools, found.fit, stroke_of(run, thickness), title=title)
    try:
        refuse_misfits(run, found)
    except InputError as error:
        raise InputError(f"{error} Section: {path}") from None
    return [*found.lines, f"section: {path}"], {**found.as_json(), "picture": str(path)}


def write_tools(tools: ToolSet, folder: Path) -> list[Path]:
    """Write stamp.stl, die.stl and, if there is one, holder.stl (binary, mm) to ``folder``, each where it starts.

    Made if it is not there. Raises :class:`ResourceError`.
    """
    import meshio

    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise resource_error(folder, error) from error
    paths = []
    for name, tool in tools.by_name.items():
        mesh = meshio.Mesh(tool.solid.points, [("triangle", tool.solid.triangles)])
        paths.append(folder / f"{name}.stl")
        with replacing(paths[-1]) as temporary:
            meshio.write(temporary, mesh, file_format="stl", binary=True)
    return paths


#: column of the curve with the travel of a tool [mm], and which way along z it counts; the die stays
TRAVEL = {"stamp": ("stamp_travel_mm", -1.0), "holder": ("holder_travel_mm", 1.0)}


def moved_tools(tools: ToolSet, history: History) -> list[Body]:
    """Meshes of ``tools``, moved by their travel at the times of the frames, between rows of the curve by the line
    through them.
    """
    found = []
    for name, tool in tools.by_name.items():
        offset = np.zeros((len(history.frames), 3))
        if name in TRAVEL:
            column, way = TRAVEL[name]
            offset[:, 2] = way * at_frames(history, column)
        found.append(Body(name, tool.solid.points, tool.solid.triangles, offset))
    return found
