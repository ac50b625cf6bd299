"""``view.html``: a run that can be turned, played and coloured in a browser, in one file."""

import base64
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from knittest import __version__
from knittest.base.atomic import write_atomic
from knittest.base.errors import InputError
from knittest.report_page.loading import LoadedRun, load_run
from knittest.report_page.moving.colours import diverging, sequential
from knittest.report_page.moving.packing import packed_recording
from knittest.report_page.moving.recording import read_recording
from knittest.report_page.moving.scales import scales_of
from knittest.report_page.page import VIEW, refresh_report

GENERATOR = "knittest view"
HERE = Path(__file__).parent
THREE, VERSION = HERE / "vendor" / "three", "0.170.0"
#: modules of the page by the name that scripts import them under
MODULES = {
    "three": THREE / "three.module.min.js",
    "orbit": THREE / "OrbitControls.js",
    **{name: HERE / "page_files" / f"{name}.js" for name in ("decode", "shaders", "scene")},
}
#: points of the small curve, and its width and height
CURVE_POINTS, WIDE, HIGH = 400, 200.0, 84.0


def view(folder: Path, frames: int | None = None) -> Path:
    """Write the moving view of the run folder ``folder`` into it, of ``frames`` frames at most; returns its path. The
    run's report gets a link to it.

    Raises :class:`InputError` for a folder that is no run or has no frames, :class:`ResourceError` when the page
    cannot be written.
    """
    if frames is not None and frames < 2:
        raise InputError(f"--frames {frames}: expected at least 2")
    run = load_run(folder)
    recording = read_recording(folder)
    if frames is not None:
        recording = recording.thinned(frames)
    header, data = packed_recording(recording, scales_of(recording))
    header |= {"maps": {"sequential": sequential(), "diverging": diverging()}, **_curve(run, recording.time)}
    page = folder / VIEW
    write_atomic(page, _html(run, header, data))
    refresh_report(folder)
    return page


def _html(run: LoadedRun, header: Mapping[str, Any], data: bytes) -> str:
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    loader = FileSystemLoader(HERE / "page_files")
    environment = Environment(loader=loader, autoescape=True, undefined=StrictUndefined, trim_blocks=True)
    curve = header["curve"]
    return environment.get_template("view.html").render(
        title=run.title,
        subtitle=str(run.setting("fabric", "title") or ""),
        notices=notices(run),
        path="M" + "L".join(f"{x},{y}" for x, y in curve["place"]) if curve else "",
        header=json.dumps(header, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c"),
        data=base64.b64encode(data).decode("ascii"),
        imports=json.dumps({"imports": {name: _module(path) for name, path in MODULES.items()}}),
        style=(HERE / "page_files" / "view.css").read_text(encoding="utf-8"),
        script=(HERE / "page_files" / "app.js").read_text(encoding="utf-8"),
        generator=GENERATOR,
        version=__version__,
        three=VERSION,
    )


def _module(path: Path) -> str:
    return f"data:text/javascript;base64,{base64.b64encode(path.read_bytes()).decode('ascii')}"


def notices(run: LoadedRun) -> list[str]:
    """Warnings that a reader needs before trusting what moves."""
    status = run.manifest.status
    found = [] if status in ("", "completed") else [f"This run has not completed: {status}."]
    return found + (["Comparison refused: " + "; ".join(run.summary.refused)] if run.summary.refused else [])


def timed(run: LoadedRun, time: np.ndarray) -> bool:
    """Tell whether ``time`` (k,) [ms] of the frames is that of the run's curve; that of a static state is none."""
    columns = run.curve
    return "time_ms" in columns and len(time) > 1 and bool(time[-1] <= columns["time_ms"].max() * 1.01)


def _curve(run: LoadedRun, time: np.ndarray) -> dict[str, Any]:
    """Curve of the run over ``time`` (k,) [ms] of the frames, and whether its time is that of the frames at all."""
    axes = run.report.axes if run.report else None
    columns, in_time = run.curve, timed(run, time)
    if not in_time or axes is None or not {axes.x, axes.y} <= set(columns):
        return {"timed": in_time, "curve": None}
    t, x, y = (columns[name] for name in ("time_ms", axes.x, axes.y))
    known = np.isfinite(t) & np.isfinite(x) & np.isfinite(y)
    t, x, y = t[known], x[known], y[known]
    if len(t) < 2 or np.ptp(x) == 0.0:
        return {"timed": in_time, "curve": None}
    kept = np.unique(
        [*np.linspace(0, len(t) - 1, CURVE_POINTS).astype(int), *np.searchsorted(t, time).clip(max=len(t) - 1)]
    )
    t, x, y = t[kept], x[kept], y[kept]
    low, high = min(0.0, float(y.min())), max(0.0, float(y.max()))
    across = WIDE * (x - x.min()) / np.ptp(x)
    down = HIGH * (high - y) / ((high - low) or 1.0)
    place = np.round(np.column_stack([across, down]), 1).tolist()
    curve = {"xlabel": axes.xlabel, "ylabel": axes.ylabel, "place": place}
    return {"timed": True, "curve": curve | {k: np.round(v, 6).tolist() for k, v in (("time", t), ("x", x), ("y", y))}}
