"""Report of the biaxial test: force per width over strain, both ways, the square at its largest force, the rails."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from knittest.base.errors import InputError
from knittest.base.history import Body, History, Specimen
from knittest.base.kinds import kinds
from knittest.experiment.conditions import Conditions
from knittest.experiment.curves import FORCE_PER_WIDTH, ReferenceCurve, per_width
from knittest.experiment.tables import PublishedValue
from knittest.export import yarn_pictures
from knittest.export.line_picture import Line, line_picture
from knittest.laboratory.base import tension_curve
from knittest.laboratory.biaxial.config import BiaxialRun
from knittest.laboratory.biaxial.test import SIDES, Biaxial, across
from knittest.laboratory.given_data import imported_corridor
from knittest.laboratory.report_base import (
    Columns,
    CurveAxes,
    References,
    Report,
    draw_energies,
    same_test,
    scatter,
    title_of,
)
from knittest.laboratory.strips import AXIS, at_frames, jaw

NAMES = (("left rail", "right rail"), ("lower rail", "upper rail"))


def rails(history: History, axis: int, sides: tuple[float, float]) -> list[Body]:
    """Rails along a rectangle of ``sides`` (along x, along y) [mm] about the origin, which move apart at the strains of
    the curve: its own along ``axis`` (0: x, 1: y), that of the other system across it.
    """
    own, cross = (0.01 * at_frames(history, column) for column in ("strain_pct", "cross_strain_pct"))
    found = []
    for normal, (side, strain) in enumerate(zip(sides, (own, cross) if axis == 0 else (cross, own), strict=True)):
        for name, way in zip(NAMES[normal], (-1.0, 1.0), strict=True):
            offset = np.zeros((len(history.frames), 3))
            offset[:, normal] = 0.5 * way * side * strain
            found.append(jaw(name, history, normal, (0.5 * way * side, way), offset, aside=0.0))
    return found


#: difference of two ratios of strains that does not matter
SAME_RATIO = 0.02


class BiaxialReport(Report[BiaxialRun]):
    """See :class:`knittest.laboratory.report_base.Report`."""

    axes = CurveAxes("strain_pct", FORCE_PER_WIDTH, "strain [%]", "force per width [N/mm]", peak="biaxial_strain_pct")
    placed_by = SIDES

    def scaled(self, run: BiaxialRun, rows: Sequence[PublishedValue]) -> list[PublishedValue]:
        """Forces per width as they are; raises :class:`InputError` for another ratio of the strains."""
        for row in rows:
            _check_ratio(run, row.conditions, f"{row.file}: {row.quantity}", "a row strain_ratio")
        return list(rows)

    def matched(self, run: BiaxialRun, curve: ReferenceCurve) -> ReferenceCurve:
        """Force per width; raises :class:`InputError` for another test, direction or ratio of the strains."""
        found = per_width(same_test(run, curve))
        _check_ratio(run, curve.conditions, curve.file or curve.source, "a line '# strain_ratio: ...' in its header")
        return found

    def size(self, run: BiaxialRun) -> tuple[float, str]:
        """No size: forces are per width."""
        return 1.0, f"square of {run.rig.side:g} mm, strains 1 : {run.rig.ratio:g}"

    def size_free(self, run: BiaxialRun, columns: Mapping[str, np.ndarray]) -> tuple[CurveAxes, Columns]:
        """The curve as it is."""
        return self.axes, dict(columns)

    def reference_curve(self, run: BiaxialRun) -> ReferenceCurve | None:
        """The fabric's own biaxial tests."""
        curve = imported_corridor(run, kinds()[run.rig.kind].published)
        return None if curve is None else self.matched(run, curve)

    def placed(self, run: BiaxialRun, specimen: Specimen) -> list[Body]:
        """The rails along which the needles slide."""
        along_x, along_y = (specimen.facts[name] for name in SIDES)
        return rails(specimen.history, AXIS[run.rig.direction], (along_x, along_y))

    def pictures(self, run: BiaxialRun, specimens: list[Specimen], references: References, folder: Path) -> None:
        """curve.png, energies.png, deformed.png."""
        self._curve_picture(run, specimens, references, folder / "curve.png")
        draw_energies(run, specimens, folder, Biaxial().span)
        yarn_pictures.strip_picture(
            folder / "deformed.png", specimens[0].history, direction=run.rig.direction, title=title_of(run)
        )

    def _curve_picture(self, run: BiaxialRun, specimens: list[Specimen], references: References, path: Path) -> None:
        """Both systems, each over its own strain; shells beside the curves that they are fed with."""
        own, other = run.rig.direction, across(run.rig.direction)
        lines = []
        for k, s in enumerate(specimens, 1):
            curve = s.history.curve
            lines.append(Line(curve["strain_pct"], curve[FORCE_PER_WIDTH], f"{own}, simulated, specimen {k}"))
            if run.rig.ratio > 0.0:
                force = curve["cross_force_n_per_mm"]
                lines.append(Line(curve["cross_strain_pct"], force, f"{other}, simulated, specimen {k}"))
        if run.model.scale == "macro":
            for direction in (own, other):
                fed = tension_curve(run.fabric, direction)
                lines.append(Line(fed.x, fed.mean, f"{direction}, input: pulled alone", ":"))
        lines += [Line(c.x, c.mean, f"{c.source} ({c.kind})", "--") for c in references.curves]
        line_picture(
            path, lines, title=f"{title_of(run)}, strains 1 : {run.rig.ratio:g}", xlabel="strain of the system [%]",
            ylabel=self.axes.ylabel, levels=self.levels(run), bands=scatter(references.curves),
        )  # fmt: skip


def _check_ratio(run: BiaxialRun, tested: Conditions, where: str, what: str) -> None:
    """Raise :class:`InputError` for a test at another ratio of the strains than the run's, or at an unknown one."""
    ratio = tested.strain_ratio
    if ratio is not None and math.isclose(ratio, run.rig.ratio, rel_tol=SAME_RATIO, abs_tol=SAME_RATIO):
        return
    stated = f"an unknown ratio of the strains (expected {what})" if ratio is None else f"a ratio of {ratio:g}"
    raise InputError(
        f"{where}: tested at {stated}, the run strains the other system {run.rig.ratio:g} times as much as the "
        f"{run.rig.direction}: expected rig.ratio of the test"
    )
