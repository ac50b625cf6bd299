"""Report of the tensile test: force over strain, and the strip at its largest force and broken."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from knittest.base.files import data_dir
from knittest.base.history import Body, Specimen
from knittest.base.kinds import kinds
from knittest.experiment.comparison import UNRATED
from knittest.experiment.conditions import EXACT, Conditions
from knittest.experiment.curves import ReferenceCurve, add_note, load_curve
from knittest.experiment.curves import scale_to_width as strip_force
from knittest.experiment.origin import borrowed_curves
from knittest.experiment.statistics import Corridor, corridor_on_grid, mean_sd
from knittest.experiment.tables import PublishedValue, factor_note, scale_to_width, with_factors
from knittest.export import line_picture, yarn_pictures
from knittest.laboratory.base import nontrivial_factors, tension_curve
from knittest.laboratory.reference_curves import with_kind
from knittest.laboratory.report_base import (
    Columns,
    CurveAxes,
    FabricReport,
    QualityCheck,
    References,
    check_same_test,
    title_of,
)
from knittest.laboratory.strips import STRIP_JAWS, modelled_width, strip_jaws, yarns_across
from knittest.laboratory.tensile.config import TensileRun
from knittest.laboratory.tensile.test import PEAK_TIME_LIMIT, pull_axis

#: points of a corridor
POINTS = 400


class TensileReport(FabricReport[TensileRun]):
    """See :class:`knittest.laboratory.report_base.Report`."""

    axes = CurveAxes(
        "strain_pct", "force_n", "strain [%]", "force [N]", "force_mean_n", "force_sd_n", peak="fracture_strain_pct"
    )
    placement_facts = STRIP_JAWS

    def quality_checks(self, run: TensileRun) -> list[QualityCheck]:
        """Standard checks, and of a macro model the uncertainty of the peak in time."""
        own = [QualityCheck("peak uncertain in time", "results", "peak_time_error_pct", PEAK_TIME_LIMIT)]
        return super().quality_checks(run) + (own if run.model.scale == "macro" else [])

    def scaled(self, run: TensileRun, rows: Sequence[PublishedValue]) -> list[PublishedValue]:
        """Scale forces to the width of the run, and those of whole yarns to that width."""
        width, factors = run.rig.width_mm, self.factors(run)
        return [
            with_factors(scale_to_width(row, width), factors, _yarn_count_text(run)[1]) if row.unit == "N" else row
            for row in rows
        ]

    def factors(self, run: TensileRun) -> tuple[float, ...]:
        """Yarns in a real strip over the whole yarns of each specimen: width x density / yarns."""
        return nontrivial_factors(
            run.rig.width_mm / modelled_width(run, run.rig.direction, k) for k in range(run.variability.specimens)
        )

    def size(self, run: TensileRun) -> tuple[float, str]:
        """Width [mm]."""
        width = run.rig.width_mm
        return width, f"{width:g} mm wide, {run.rig.gauge_length_mm:g} mm between the clamps"

    def size_free_curve(self, run: TensileRun, columns: Mapping[str, np.ndarray]) -> tuple[CurveAxes, Columns]:
        """Force per width, of a meso model per width of its whole yarns."""
        forces, width = (self.axes.y, self.axes.mean, self.axes.sd), run.rig.width_mm
        whole = self.scale_to_nominal_size(run, columns)
        found = {name: values / width if name in forces else values for name, values in whole.items()}
        return replace(self.axes, ylabel="force per width [N/mm]"), found

    def reference_curve(self, run: TensileRun) -> ReferenceCurve | None:
        """Curve of the fabric's experiment for the width of the strip; another fabric's is a macro input alone."""
        owner = borrowed_curves(run.fabric).get(f"macro.tension.{run.rig.direction}")
        if owner and run.model.scale == "meso":
            return None
        text = run.fabric.macro.curve_files.get(f"tension.{run.rig.direction}")
        if text is None and (run.model.scale == "meso" or run.fabric.macro.tension is None):
            return None
        path = data_dir() / (text or "")
        if text is not None and not path.is_file():
            return None
        curve = tension_curve(run.fabric, run.rig.direction) if text is None else load_curve(path)
        if run.model.scale == "meso":
            if curve.kind not in UNRATED:
                curve = with_kind(run, path, curve, kinds()[run.rig.kind].published)
            return self.scale_curve(run, curve)
        curve = self.scale_curve(run, curve)
        source = f"{curve.source}; assumed: of {owner}" if owner else curve.source
        given = replace(curve, kind="input", source=source)
        return add_note(given, f"the input of the macro model is itself {curve.kind}")

    def conditions(self, run: TensileRun) -> Conditions:
        """Also the size of the strip."""
        return replace(
            super().conditions(run), strip_width_mm=run.rig.width_mm, gauge_length_mm=run.rig.gauge_length_mm
        )

    def scale_curve(self, run: TensileRun, curve: ReferenceCurve) -> ReferenceCurve:
        """Force [N] for the width of the run; strain is relative, and a note states another gauge length."""
        curve = strip_force(check_same_test(run, curve), run.rig.width_mm)
        if factors := self.factors(run):
            curve = add_note(curve, factor_note(factors, _yarn_count_text(run)[1]))
        gauge, own = curve.conditions.gauge_length_mm, run.rig.gauge_length_mm
        if gauge is None or math.isclose(gauge, own, rel_tol=EXACT):
            return curve
        return add_note(curve, f"{own:g} instead of {gauge:g} mm between the clamps; strain is relative to it")

    def curve(self, specimens: list[Specimen]) -> Columns:
        """Channels of one specimen, or mean and sd of the force of several."""
        if len(specimens) == 1:
            return specimens[0].history.curve
        found = corridor(specimens)
        return {self.axes.x: found.strain, self.axes.mean: found.mean, self.axes.sd: found.sd}

    def placed(self, run: TensileRun, specimen: Specimen) -> list[Body]:
        """Both jaws."""
        return strip_jaws(specimen, pull_axis(run))

    def draw_specimen(self, run: TensileRun, specimen: Specimen, folder: Path) -> None:
        """Draw deformed.png."""
        path, direction = folder / "deformed.png", run.rig.direction
        yarn_pictures.strip_picture(path, specimen.history, direction=direction, title=title_of(run))

    def draw_curve(self, run: TensileRun, specimens: list[Specimen], references: References, path: Path) -> None:
        """Draw the force of the real strip, with the published end point."""
        rows = {row.quantity: row for row in references.rows}
        end_point, peak, strain = None, rows.get("peak_force_n"), rows.get("fracture_strain_pct")
        if peak and strain:
            end_point = line_picture.EndPoint(strain.mean, strain.sd, peak.mean, peak.sd, peak.table)
        shown = [line_picture.Reference(c.x, c.mean, c.kind, c.source) for c in references.curves]
        whole = []
        for k, specimen in enumerate(specimens):
            history, width = specimen.history, modelled_width(run, run.rig.direction, k)
            force = history.curve["force_n"] * (run.rig.width_mm / width)
            whole.append(replace(specimen, history=replace(history, curve=history.curve | {"force_n": force})))
        meso = run.model.scale == "meso"
        line_picture.curve_picture(
            path, [s.history.curve for s in whole], title=title_of(run), references=shown, end_point=end_point,
            corridor=_corridor_to_draw(whole) if len(whole) > 1 else None,
            yarns=(*_yarn_count_text(run), run.rig.direction) if meso else None,
        )  # fmt: skip


def _yarn_count_text(run: TensileRun) -> tuple[float, str]:
    """Yarns in the width of the real strip, and the same with those of the model, in words."""
    counts = {yarns_across(run, run.rig.direction, k) for k in range(run.variability.specimens)}
    whole = run.rig.width_mm * run.fabric.density_per_mm.of(run.rig.direction)
    return whole, f"{' or '.join(map(str, sorted(counts)))} yarns modelled, {whole:.4g} in the real strip"


def corridor(specimens: list[Specimen]) -> Corridor:
    """Corridor of the force [N] up to the smallest strain at maximum force of all specimens."""
    curves = [_curve_to_peak(s) for s in specimens]
    return corridor_on_grid(np.linspace(0.0, min(x[-1] for x, _ in curves), POINTS), curves)


def _corridor_to_draw(specimens: list[Specimen]) -> line_picture.Corridor:
    found, ends = corridor(specimens), np.array([[v[-1] for v in _curve_to_peak(s)] for s in specimens])
    peak = line_picture.EndPoint(*mean_sd(ends[:, 0]), *mean_sd(ends[:, 1]))
    return line_picture.Corridor(found.strain, found.mean, found.sd, peak)


def _curve_to_peak(specimen: Specimen) -> tuple[np.ndarray, np.ndarray]:
    curve = specimen.history.curve
    end = int(np.argmax(curve["force_n"])) + 1
    return curve["strain_pct"][:end], curve["force_n"][:end]
