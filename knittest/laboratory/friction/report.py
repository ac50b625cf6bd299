"""Report of the friction test: pull force over travel, and pressure.png of the pressure between fabric and plates."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from knittest.base.errors import InputError
from knittest.base.figure import GREY, new_figure, save
from knittest.base.history import Array, Body, Specimen
from knittest.experiment.conditions import Conditions, values_agree
from knittest.experiment.curves import ReferenceCurve
from knittest.experiment.tables import PublishedValue, rejected_row_lines, with_note
from knittest.export.line_picture import Level
from knittest.laboratory.friction.config import FrictionRun
from knittest.laboratory.friction.rig import KINETIC_SHARE, PLATES, plates, pressure_map, pull_axis
from knittest.laboratory.friction.test import FORCE_TOLERANCE, PENETRATION_TOLERANCE, map_cell
from knittest.laboratory.reference_curves import imported_corridor
from knittest.laboratory.report_base import Columns, CurveAxes, FabricReport, QualityCheck, SizeFreeReport, title_of
from knittest.laboratory.strips import offsets, two_plates

#: lengths of the picture [inch]: a map across, what lies left and right of it, above and below both, above each
WIDE, LEFT, RIGHT, TOP, BOTTOM, HEAD = 7.8, 0.8, 1.4, 0.65, 1.0, 0.55
#: least height of the scale [inch], and share of the loaded cells that the colours span
SCALE, SPANNED = 1.6, 99.0


def pressure_picture(
    path: Path, x: Array, y: Array, pressure: Mapping[str, Array], *, along: str, title: str, note: str
) -> None:
    """Maps of ``pressure`` [MPa] by face, (n_x, n_y), between edges ``x``, ``y`` [mm]; the pull is ``along`` x or y."""
    long, across = (x, y) if along == "x" else (y, x)
    high = WIDE * float(np.ptp(across) / np.ptp(long))
    both = max(len(pressure) * (high + HEAD), SCALE)
    wide, tall = LEFT + WIDE + RIGHT, TOP + both + BOTTOM
    figure = new_figure(wide, tall)
    loaded = np.concatenate([p[p > 0.0] for p in pressure.values()])
    most = float(np.percentile(loaded, SPANNED)) if len(loaded) else 1.0
    for number, (face, values) in enumerate(pressure.items()):
        down = TOP + number * (high + HEAD) + HEAD - 0.25 + high
        axes = figure.add_axes((LEFT / wide, 1.0 - down / tall, WIDE / wide, high / tall))
        shown = values.T if along == "x" else values
        drawn = axes.pcolormesh(
            long - long[0], across - across[0], np.where(shown > 0.0, shown, np.nan), cmap="viridis", vmin=0.0,
            vmax=most, rasterized=True,
        )  # fmt: skip
        axes.set_aspect("equal")
        axes.set_facecolor("#f3f4f5")
        axes.set_title(f"technical {face}, largest {values.max():.2f} MPa", loc="left", fontsize=10)
        axes.set_ylabel("across [mm]", fontsize=9)
        axes.tick_params(labelbottom=number == len(pressure) - 1)
    axes.set_xlabel("along the pull, clamp to the right [mm]")
    bar = figure.colorbar(
        drawn,
        cax=figure.add_axes(((LEFT + WIDE + 0.25) / wide, BOTTOM / tall, 0.18 / wide, (both - 0.3) / tall)),
        extend="max" if loaded.max(initial=0.0) > (1.0 + 1e-6) * most else "neither",
    )
    bar.set_label("mean contact\npressure [MPa]")
    figure.text(LEFT / wide, 1.0 - 0.35 / tall, title, fontsize=12)
    figure.text(LEFT / wide, 0.15 / tall, note, fontsize=9, color=GREY)
    save(figure, path)


class FrictionReport(SizeFreeReport[FrictionRun], FabricReport[FrictionRun]):
    """See :class:`knittest.laboratory.report_base.Report`."""

    axes = CurveAxes(
        "displacement_mm", "pull_force_n", "travel of the clamp [mm]", "pull force [N]", reach="rig.travel"
    )
    placement_facts = ("lower_face_mm", "upper_face_mm")

    def scaled(self, run: FrictionRun, rows: Sequence[PublishedValue]) -> list[PublishedValue]:
        """Pull forces under the run's normal force, by Coulomb's law; half of F_R/F_N for a missing mu_per_face."""
        found, forces, normal = [], [], run.rig.normal_force_n
        for row in rows:
            tested = row.conditions.normal_force_n
            if not row.quantity.startswith("pull_force"):
                found.append(row)
            elif tested and values_agree(tested, normal):
                forces.append(row)
            elif tested:
                scaled = replace(row, mean=row.mean * normal / tested, sd=row.sd * normal / tested)
                forces.append(with_note(scaled, f"under {normal:g} instead of {tested:g} N"))
        if "mu_per_face" not in {row.quantity for row in rows}:
            halves = [replace(row, mean=0.5 * row.mean, sd=0.5 * row.sd) for row in rows if row.quantity == "mu_paper"]
            found += [with_note(replace(row, quantity="mu_per_face"), "half of F_R/F_N") for row in halves]
        return forces + found

    def apart(self, run: FrictionRun, rows: Sequence[PublishedValue]) -> list[str]:
        """Pull forces of a table that states no normal force."""
        unknown = "under an unknown normal force (no row normal_force_n)"
        forces = [row for row in rows if row.quantity.startswith("pull_force")]
        return rejected_row_lines((row, "" if row.conditions.normal_force_n else unknown) for row in forces)

    def conditions(self, run: FrictionRun) -> Conditions:
        """Also the normal force."""
        return replace(super().conditions(run), normal_force_n=run.rig.normal_force_n)

    def scale_curve(self, run: FrictionRun, curve: ReferenceCurve) -> ReferenceCurve:
        """``curve``; raises :class:`InputError` for one under another or an unknown normal force."""
        normal, tested = run.rig.normal_force_n, curve.conditions.normal_force_n
        if tested is None or not values_agree(tested, normal):
            stated = "an unknown normal force" if tested is None else f"{tested:g} N"
            raise InputError(
                f"{curve.file or curve.source}: {curve.y_name} under {stated}, in the run under {normal:g} N: set "
                "rig.normal_force to that of the test, stated by '# normal_force_n: ...' in the header (--normal-force)"
            )
        return super().scale_curve(run, curve)

    def levels(self, run: FrictionRun) -> list[Level]:
        """Coulomb's levels of two faces."""
        force, by_name = run.rig.normal_force, {"kinetic": run.rig.kinetic_coefficient}
        if run.rig.static_coefficient != run.rig.kinetic_coefficient:
            by_name["static"] = run.rig.static_coefficient
        return [
            Level(2.0 * mu * force, f"two faces, {name}: 2 x {mu:.4g} x {force:g} N") for name, mu in by_name.items()
        ]

    def quality_checks(self, run: FrictionRun) -> list[QualityCheck]:
        """Standard checks, normal force and penetration of the plates."""
        return [
            *super().quality_checks(run),
            QualityCheck("normal force off", "results", "normal_force_error_pct", FORCE_TOLERANCE),
            QualityCheck(
                "plate penetration over element deformation", "results", "penetration_over_deformation_pct",
                PENETRATION_TOLERANCE,
            ),
        ]  # fmt: skip

    def reference_curve(self, run: FrictionRun) -> ReferenceCurve | None:
        """Corridor of the fabric's own strips under the same normal force."""
        curve = imported_corridor(run)
        if curve is None or not values_agree(curve.conditions.normal_force_n or 0.0, run.rig.normal_force_n):
            return None
        return self.scale_curve(run, curve)

    def tables(self, run: FrictionRun, specimens: list[Specimen]) -> dict[str, Columns]:
        """pressure.csv of the first specimen."""
        return {"pressure.csv": pressure_map(specimens[0].history, map_cell(run)).table()}

    def placed(self, run: FrictionRun, specimen: Specimen) -> list[Body]:
        """Both plates, of which the upper one is free along z."""
        history, axis = specimen.history, pull_axis(run)
        faces = specimen.facts["lower_face_mm"], specimen.facts["upper_face_mm"]
        centres, lengths = plates(run.rig, axis, history.frames[0].position, faces)
        lower = offsets(history, {axis: "displacement_mm"}, -1.0)
        upper = lower + offsets(history, {2: "plate_travel_mm"})
        return two_plates(centres, lengths, (lower, upper))

    def draw_specimen(self, run: FrictionRun, specimen: Specimen, folder: Path) -> None:
        """Draw pressure.png."""
        found = pressure_map(specimen.history, map_cell(run))
        low, travel = (1.0 - KINETIC_SHARE) * run.rig.travel, run.rig.travel
        forces = " and ".join(f"{f:.0f} N ({name})" for f, name in zip(found.force, PLATES, strict=True))
        pressure_picture(
            folder / "pressure.png", found.x, found.y, dict(zip(PLATES, found.pressure, strict=True)),
            along="xy"[pull_axis(run)], title=title_of(run),
            note=f"mean over {low:g} to {travel:g} mm of travel, cells of {map_cell(run):.2f} mm; sums: {forces}",
        )  # fmt: skip
