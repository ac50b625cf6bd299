"""Record of the compaction test."""

from knittest.base.kinds import SHEETS, Regression, RegressionRuns, TestKind
from knittest.laboratory.records import labels_at

KIND = TestKind(
    name="compaction",
    place=5,
    tools=True,
    directional=False,
    summary="Compaction between two plates, meso.",
    usage="""Press a piece of fabric between two plates: thickness over pressure, work, exponent of van Wyk's law.

    Example: knittest compaction --variant 1
    """,
    run="knittest.laboratory.compaction.config:CompactionRun",
    test="knittest.laboratory.compaction.test:Compaction",
    report="knittest.laboratory.compaction.report:CompactionReport",
    size=("plates of {rig.side:g} mm", "pressed with {rig.max_pressure:g} kPa"),
    labels={
        **labels_at("thickness_mm_at_kpa", "thickness at {} kPa [mm]", "{:.3f}", (1, 10, 100, 1000)),
        "compaction_work_j_per_m2": ("work of compaction [J/m2]", "{:.1f}"),
        "compaction_exponent": ("exponent of compaction, van Wyk 3 [-]", "{:.2f}"),
        "law_scatter_pct": ("scatter of the pressure about the fit [%]", "{:.0f}"),
        "largest_pressure_kpa": ("largest pressure [kPa]", "{:.4g}"),
        "plate_difference_pct": ("largest difference of the plates' forces [%]", "{:.2f}"),
        "plate_sunk_pct": ("penetration of the plates over their travel [%]", "{:.2f}"),
        "run_speed_m_per_s": ("test speed [m/s]", "{:.3g}"),
    },
    diagnostic=(
        "law_scatter_pct", "largest_pressure_kpa", "plate_difference_pct", "plate_sunk_pct", "run_speed_m_per_s",
    ),
    published=tuple(f"thickness_mm_at_kpa.{p}" for p in (1, 10, 100, 1000)),
    pictures=("curve.png", "energies.png", "deformed.png"),
    scales=("meso",),
    presets="knittest.laboratory.compaction.config:settings",
    laboratory="knittest.laboratory.compaction.lab_files:LAB",
    sizes=("side",),
    deciding={
        "meso": (
            "reinforcing.beam_diameter", "knitting.beam_diameter", "contact.normal_stiffness", "reinforcing.crimp.warp",
            "reinforcing.crimp.weft",
        ),
    },
    hinges={"membrane_share": -1},
    regression=Regression(
        runs=(RegressionRuns(2, "quick", "meso", "quick", SHEETS, ("rig.side=10",), "10mm", enlarges=True),)
    ),
)  # fmt: skip
