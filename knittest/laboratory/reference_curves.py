"""Reference curves of a run: input of its model, used for fitting, imported, or a user's own."""

import textwrap
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from knittest.base.errors import InputError
from knittest.base.figure import use_stamp
from knittest.base.files import data_dir
from knittest.base.kinds import kinds
from knittest.config.loading import resolve
from knittest.config.run import Run
from knittest.experiment.comparison import LEFT_OUT, SAME, STRAIN, column_of, columns_of
from knittest.experiment.conditions import UNKNOWN, Conditions, merge_conditions
from knittest.experiment.curves import (
    ReferenceCurve,
    add_note,
    load_curve,
    normalise_force,
    read_simulated,
    resolve_path,
    to_force_per_width,
)
from knittest.experiment.lab_results import SHEAR, TENSION, folder_name
from knittest.experiment.origin import ORIGINS, is_curve, tuning_labels
from knittest.experiment.time_history import is_time_history, read_time_history
from knittest.export.line_picture import Band, Line, line_picture
from knittest.laboratory.report_base import REPORTS, run_stamp, title_of
from knittest.materials.trellis import CONJUGATE, NORMALISED, to_conjugate

#: rms difference of two curves over the largest force below which they are the same data, rounded or at other points;
#: strips of one fabric scatter ten times as much
ROUNDING = 0.005
SPECIMENS = "specimen-*.csv"


def input_reason(run: Run, path: Path, curve: ReferenceCurve) -> str:
    """Reason to call ``curve`` an input: its file, source or data, or its import, is given to the model; else empty."""
    if given_to_rig := ORIGINS[run.rig.kind].given_curve_part(run, path):
        return given_to_rig
    if run.model.scale != "macro":
        return ""
    files = [data_dir() / text for name, text in run.fabric.macro.curve_files.items() if name != "biaxial"]
    files = [file for file in files if file.is_file()]
    if path.resolve() in [file.resolve() for file in files]:
        return "input of the macro model: this file"
    given = [load_curve(file) for file in files]
    if curve.source != path.name and curve.source in [one.source for one in given]:
        return "input of the macro model: a curve of the same source"
    if any(is_same_data(curve, one) for one in given):
        return "input of the macro model: the same data"
    of_import = any(
        is_same_data(curve, one) for file in files for one in readable_curves(sorted(file.parent.glob(SPECIMENS)))
    )
    if not of_import:
        means = readable_curves([path.parent / name for name in (TENSION, SHEAR)] if path.match(SPECIMENS) else [])
        of_import = any(is_same_data(mean, one) for mean in means for one in given)
    return "input of the macro model: the mean of this specimen's series" if of_import else ""


def readable_curves(paths: Iterable[Path]) -> Iterator[ReferenceCurve]:
    """Curves among ``paths``."""
    for path in paths:
        try:
            yield load_curve(path)
        except InputError:  # nothing that could be the same
            continue


def is_same_data(one: ReferenceCurve, other: ReferenceCurve) -> bool:
    """Tell whether two curves differ by rounding only, over the range that counts."""
    try:
        one, other = _size_free_curve(one), _size_free_curve(other)
    except InputError:  # of unknown size: not comparable
        return False
    if (one.x_name, one.y_name) != (other.x_name, other.y_name):
        return False
    low, high = max(one.x[0], other.x[0]), min(_curve_end(one), _curve_end(other))
    if high - low < (1.0 - LEFT_OUT) * max(_curve_end(one) - one.x[0], _curve_end(other) - other.x[0]):
        return False
    grid = np.linspace(low, high, 201)
    first, second = np.interp(grid, one.x, one.mean), np.interp(grid, other.x, other.mean)
    return bool(np.sqrt(np.mean((first - second) ** 2)) <= ROUNDING * np.abs(second).max())


def _size_free_curve(curve: ReferenceCurve) -> ReferenceCurve:
    if curve.x_name == STRAIN:
        return to_force_per_width(curve)
    if curve.y_name == CONJUGATE:
        share = to_conjugate(1.0, np.deg2rad(curve.x), "normalised")
        return replace(curve, mean=curve.mean / share, y_name=NORMALISED)
    return normalise_force(curve)


def _curve_end(curve: ReferenceCurve) -> float:
    """Strain [%] at the largest force of a strip, last angle [deg] of a frame."""
    return float(curve.x[int(np.argmax(curve.mean))] if curve.x_name == STRAIN else curve.x[-1])


def with_kind(run: Run, path: Path, curve: ReferenceCurve, quantities: Sequence[str]) -> ReferenceCurve:
    """``curve``, read from ``path``, marked as an input or as tuned by ``quantities``, where ``run`` used it so."""
    if given := input_reason(run, path, curve):
        return add_note(replace(curve, kind="input"), given)
    tuned = tuning_reason(run, path, curve, quantities)
    return add_note(replace(curve, kind="tuned"), tuned) if tuned else curve


def tuning_reason(run: Run, path: Path, curve: ReferenceCurve, quantities: Sequence[str]) -> str:
    """Reason to call ``curve`` tuned: parameters of ``run`` were fitted to it or its rows, or may be; else empty."""
    scale, fabric = run.model.scale, run.fabric
    labels = dict.fromkeys(
        label for quantity in quantities for label in tuning_labels(fabric, scale, run.direction, quantity)
    )
    of_curves = [label for label in labels if is_curve(label, run.direction)]
    found = of_curves or (list(labels) if labels and _is_own_curve(run, path, curve) else [])
    return f"model parameters were fitted to or chosen by {', '.join(found)}" if found else ""


def _is_own_curve(run: Run, path: Path, curve: ReferenceCurve) -> bool:
    """Tell whether ``curve`` is from the experiment of the run's fabric: by its file, source or data."""
    if run.fabric.experiment is None:
        return False
    folder = data_dir() / run.fabric.experiment
    if path.resolve().is_relative_to(folder.resolve()):
        return True
    own = folder / folder_name(run.rig.kind, run.direction)
    return any(
        is_same_data(curve, one) or (curve.source != path.name and curve.source == one.source)
        for one in readable_curves([own / "corridor.csv", *sorted(own.glob(SPECIMENS))])
    )


def imported_corridor(run: Run) -> ReferenceCurve | None:
    """Corridor of the run's test and direction in its fabric's experiment, as :func:`with_kind`; None without one."""
    if run.fabric.experiment is None:
        return None
    path = data_dir() / run.fabric.experiment / folder_name(run.rig.kind, run.direction) / "corridor.csv"
    return with_kind(run, path, load_curve(path), kinds()[run.rig.kind].published) if path.is_file() else None


def matched_corridor(run: Run) -> ReferenceCurve | None:
    """:func:`imported_corridor` as the curve of ``run`` can be compared with it; None without one."""
    curve = imported_corridor(run)
    return None if curve is None else REPORTS[run.rig.kind].scale_curve(run, curve)


#: characters of a line in the legend
LEGEND = 105


def own_curves(run: Run, paths: Sequence[Path], given: Conditions = UNKNOWN) -> list[ReferenceCurve]:
    """Curves in ``paths`` for the size of ``run``; ``given`` states open conditions. Raises :class:`InputError`."""
    report, found = REPORTS[run.rig.kind], []
    names = (report.axes.x, report.axes.y, *report.axes.others)
    for path in map(resolve_path, paths):
        curve = _simulated_curve(run, path, given)
        if curve is None:
            curve = load_curve(path, given)
            column_of(names, curve.x_name, curve)
            curve = with_kind(run, path, curve, kinds()[run.rig.kind].published)
        found.append(report.scale_curve(run, curve))
        columns_of(names, found[-1])
    return found


def _simulated_curve(run: Run, path: Path, given: Conditions) -> ReferenceCurve | None:
    """First loading in the curve.csv ``path`` of a run, whose config.yaml in the same folder states the conditions.

    A file without a config.yaml counts as of the test of ``run``, a time history of OpenRadioss as of its deck; None
    for a file that no run has written.
    """
    other, config, of_deck = run, path.parent / "config.yaml", is_time_history(path)
    if of_deck:
        columns, conditions = deck_columns(run, path), REPORTS[run.rig.kind].conditions(run)
        columns = REPORTS[run.rig.kind].scale_to_nominal_size(run, columns)
    elif (read := read_simulated(path)) is None:
        return None
    else:
        columns, conditions = read
    if config.is_file() and not of_deck:
        other = resolve(config=config)
        conditions = merge_conditions(REPORTS[other.rig.kind].conditions(other), conditions, str(path))
        columns = REPORTS[other.rig.kind].scale_to_nominal_size(other, columns)
    axes = REPORTS[other.rig.kind].axes
    force = next((n for n in (NORMALISED, axes.mean) if n in columns), axes.y)
    if absent := [name for name in (axes.x, force) if name not in columns]:
        raise InputError(f"{path}: no column {absent[0]}, as a curve.csv of {other.rig.kind} has; check the test")
    source = f"OpenRadioss, {path.name}" if of_deck else f"{path.parent.name}/{path.name}"
    x, y = columns[axes.x], columns[force]
    rises = np.append(True, x[1:] > np.maximum.accumulate(x)[:-1])
    x_name, y_name = (next((n for n, same in SAME.items() if name in same), name) for name in (axes.x, force))
    return ReferenceCurve(
        "simulated", x[rises], y[rises], columns[axes.sd][rises] if axes.sd in columns else None, x_name, y_name,
        source, conditions=merge_conditions(conditions, given, str(path)), file=str(path),
    )  # fmt: skip


def deck_columns(run: Run, path: Path) -> dict[str, np.ndarray]:
    """Columns of the curve in the time history ``path`` of OpenRadioss, which ran the deck of ``run``.

    Raises :class:`InputError` for a test without such a deck.
    """
    if not kinds()[run.rig.kind].deck_curve:
        known = ", ".join(name for name, kind in kinds().items() if kind.deck_curve)
        raise InputError(f"{path}: a time history of OpenRadioss; {run.rig.kind} has no such deck, only {known} have")
    columns: dict[str, np.ndarray] = kinds()[run.rig.kind].load("deck_curve")(run, read_time_history(path))
    return columns


def draw_comparison(
    run: Run, columns: Mapping[str, np.ndarray], curve: ReferenceCurve, path: Path, identity: str
) -> None:
    """Draw the curve of ``run`` in ``columns`` and the reference to ``path`` (PNG), ``identity`` below the title."""
    x, y = columns_of(columns, curve)
    axes = REPORTS[run.rig.kind].axes
    labels = [f"simulated, {identity}", f"{curve.source} ({curve.kind})"]
    labels[1] += f": {curve.note}" if curve.note else ""
    simulated, reference = (textwrap.fill(label, LEGEND) for label in labels)
    lines = [Line(columns[x], columns[y], simulated), Line(curve.x, curve.mean, reference, "--")]
    bands = []
    if curve.sd is not None:
        bands.append(Band(curve.x, curve.mean - curve.sd, curve.mean + curve.sd, f"{curve.kind}, ± sd"))
    if y == axes.mean and axes.sd in columns:
        spread = columns[axes.sd]
        bands.append(Band(columns[x], columns[y] - spread, columns[y] + spread, "simulated, ± sd"))
    with use_stamp(run_stamp(run, ())):  # a rejected run is not compared
        line_picture(
            path, lines, title=title_of(run), xlabel=axes.xlabel, ylabel=axes.labels.get(y, axes.ylabel), bands=bands,
        )  # fmt: skip


def run_caption(run: Run, folder: Path, manifest: Mapping[str, object]) -> str:
    """Preset, size, folder and date of a run, as in a picture."""
    _, size = REPORTS[run.rig.kind].size(run)
    started = str(manifest.get("started") or "")[:10]
    return ", ".join(filter(None, (f"preset {run.model.preset}", size, folder.resolve().name, started)))
