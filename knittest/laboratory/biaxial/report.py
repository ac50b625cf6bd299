"""Report of the biaxial test: force per width over strain, both ways, the square at its largest force, the rails."""

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from knittest.base.errors import InputError
from knittest.base.history import Body, History, Specimen
from knittest.experiment.conditions import Conditions
from knittest.experiment.curves import FORCE_PER_WIDTH, ReferenceCurve, to_force_per_width
from knittest.experiment.tables import PublishedValue
from knittest.export import yarn_pictures
from knittest.export.line_picture import Line
from knittest.laboratory.base import tension_curve
from knittest.laboratory.biaxial.config import BiaxialRun
from knittest.laboratory.biaxial.test import SIDES, cross_direction
from knittest.laboratory.reference_curves import matched_corridor
from knittest.laboratory.report_base import (
    CurveAxes,
    FabricReport,
    References,
    SizeFreeReport,
    check_same_test,
    title_of,
)
from knittest.laboratory.strips import AXIS, make_jaw, values_at_frames

NAMES = (("left rail", "right rail"), ("lower rail", "upper rail"))


def rails(history: History, axis: int, sides: tuple[float, float]) -> list[Body]:
    """Rails along a rectangle of ``sides`` (x, y) [mm] about the origin; ``axis`` (0: x, 1: y) is the direction."""
    own, cross = (0.01 * values_at_frames(history, column) for column in ("strain_pct", "cross_strain_pct"))
    found = []
    for normal, (side, strain) in enumerate(zip(sides, (own, cross) if axis == 0 else (cross, own), strict=True)):
        for name, way in zip(NAMES[normal], (-1.0, 1.0), strict=True):
            offset = np.zeros((len(history.frames), 3))
            offset[:, normal] = 0.5 * way * side * strain
            found.append(make_jaw(name, history, normal, (0.5 * way * side, way), offset, aside=0.0))
    return found


#: difference of two ratios of strains that does not matter
SAME_RATIO = 0.02


class BiaxialReport(SizeFreeReport[BiaxialRun], FabricReport[BiaxialRun]):
    """See :class:`knittest.laboratory.report_base.Report`."""

    axes = CurveAxes("strain_pct", FORCE_PER_WIDTH, "strain [%]", "force per width [N/mm]", peak="biaxial_strain_pct")
    placement_facts = SIDES

    def scaled(self, run: BiaxialRun, rows: Sequence[PublishedValue]) -> list[PublishedValue]:
        """Forces per width as they are; raises :class:`InputError` for another ratio of the strains."""
        for row in rows:
            _check_ratio(run, row.conditions, f"{row.file}: {row.quantity}", "a row strain_ratio")
        return list(rows)

    def conditions(self, run: BiaxialRun) -> Conditions:
        """Also the ratio of the strains."""
        return replace(super().conditions(run), strain_ratio=run.rig.ratio)

    def scale_curve(self, run: BiaxialRun, curve: ReferenceCurve) -> ReferenceCurve:
        """Force per width; raises :class:`InputError` for another test, direction or ratio of the strains."""
        found = to_force_per_width(check_same_test(run, curve))
        _check_ratio(run, curve.conditions, curve.file or curve.source, "a line '# strain_ratio: ...' in its header")
        return found

    def size(self, run: BiaxialRun) -> tuple[float, str]:
        """No size: forces are per width."""
        return 1.0, f"square of {run.rig.side:g} mm, strains 1 : {run.rig.ratio:g}"

    def reference_curve(self, run: BiaxialRun) -> ReferenceCurve | None:
        """Corridor of the fabric's own biaxial tests."""
        return matched_corridor(run)

    def placed(self, run: BiaxialRun, specimen: Specimen) -> list[Body]:
        """The rails along which the needles slide."""
        along_x, along_y = (specimen.facts[name] for name in SIDES)
        return rails(specimen.history, AXIS[run.rig.direction], (along_x, along_y))

    def draw_specimen(self, run: BiaxialRun, specimen: Specimen, folder: Path) -> None:
        """Draw deformed.png."""
        path, direction = folder / "deformed.png", run.rig.direction
        yarn_pictures.strip_picture(path, specimen.history, direction=direction, title=title_of(run))

    def draw_curve(self, run: BiaxialRun, specimens: list[Specimen], references: References, path: Path) -> None:
        """Draw both systems, each over its own strain, and the input curves of a macro model."""
        own, other = run.rig.direction, cross_direction(run.rig.direction)
        lines = []
        for k, s in enumerate(specimens, 1):
            curve = s.history.curve
            lines.append(Line(curve["strain_pct"], curve[FORCE_PER_WIDTH], f"{own}, simulated, specimen {k}"))
            if run.rig.ratio > 0.0:
                force = curve["cross_force_n_per_mm"]
                lines.append(Line(curve["cross_strain_pct"], force, f"{other}, simulated, specimen {k}"))
        if run.model.scale == "macro":
            for direction in (own, other):
                uniaxial = tension_curve(run.fabric, direction)
                lines.append(Line(uniaxial.x, uniaxial.mean, f"{direction}, input: uniaxial", ":"))
        title = f"{title_of(run)}, strains 1 : {run.rig.ratio:g}"
        self.draw_lines(run, lines, references, path, title=title, xlabel="strain of the system [%]")


def _check_ratio(run: BiaxialRun, tested: Conditions, where: str, what: str) -> None:
    ratio = tested.strain_ratio
    if ratio is not None and math.isclose(ratio, run.rig.ratio, rel_tol=SAME_RATIO, abs_tol=SAME_RATIO):
        return
    stated = f"an unknown strain ratio (expected {what})" if ratio is None else f"a strain ratio of {ratio:g}"
    raise InputError(
        f"{where}: tested at {stated}; in the run the other system is strained {run.rig.ratio:g} times as much as the "
        f"{run.rig.direction}: set rig.ratio to that of the test"
    )
