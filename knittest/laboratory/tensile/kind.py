"""Record of the tensile test."""

from knittest.base.kinds import STRIPS, Regression, RegressionRuns, TestKind
from knittest.laboratory.records import TENSION_FIELDS, labels_at

#: forces per width [N/mm] at which the strain of strips of loops is read
KNIT_FORCES = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5)

KIND = TestKind(
    name="tensile",
    place=1,
    summary="Strip tensile test to failure, macro or meso.",
    usage="""Pull a strip (200 x 50 mm, DIN EN ISO 13934-1) to failure and compare with the experiment.

    Example: knittest tensile --variant 2 --scale meso --preset paper --direction weft
    """,
    run="knittest.laboratory.tensile.config:TensileRun",
    test="knittest.laboratory.tensile.test:Tensile",
    report="knittest.laboratory.tensile.report:TensileReport",
    deck_force="bndout (the set that moves) and spcforc (the set held in all six), along the strip",
    deck_curve="knittest.laboratory.tensile.test:strip_curve",
    size=("strip {rig.width:g} mm wide, {rig.gauge_length:g} mm between the clamps",),
    sheet=("gauge_length", "width"),
    lasting="knittest.laboratory.tensile.test:expected_share",
    labels={
        "peak_force_n": ("peak force [N]", "{:.0f}"),
        "fracture_strain_pct": ("fracture strain [%]", "{:.2f}"),
        "peak_force_n_per_mm": ("peak force per width [N/mm]", "{:.1f}"),
        "force_per_yarn_n": ("force per yarn [N]", "{:.1f}"),
        **labels_at("strain_pct_at_n_per_mm", "strain at {} N/mm [%]", "{:.1f}", KNIT_FORCES),
        "largest_force_n_per_mm": ("largest force per width [N/mm]", "{:.3f}"),
        "strain_at_largest_force_pct": ("strain at it [%]", "{:.1f}"),
        "contraction_pct": ("contraction across at it [%]", "{:.1f}"),
        "peak_time_error_pct": ("peak, uncertain in time [%]", "{:.2f}"),
    },
    diagnostic=("peak_time_error_pct",),
    sized={"peak_force_n": "peak_force_n_per_mm"},
    published=("peak_force_n", "fracture_strain_pct"),
    row_names={"peak_force_n": "max. tensile force", "fracture_strain_pct": "fracture strain"},
    pictures=("curve.png", "energies.png", "deformed.png"),
    presets="knittest.laboratory.tensile.config:settings",
    sizes=("gauge_length", "width"),
    deciding={"macro": ("macro.tension.{d}", "macro.fracture_strain.{d}"), "meso": ("{d}_density", *TENSION_FIELDS)},
    fed=("macro",),
    hinges={"stop_force_ratio": 1},
    converged=0.01,
    studied=True,
    regression=Regression(
        rows=("peak_force_n", "fracture_strain_pct"),
        runs=(
            RegressionRuns(2, "quick", "meso", "quick", STRIPS),
            RegressionRuns(7, "quick", "macro", "quick", STRIPS),
            RegressionRuns(4, "full", "meso", "paper", STRIPS),
            RegressionRuns(8, "full", "macro", "paper", STRIPS),
        ),
    ),
    laboratory="knittest.laboratory.tensile.lab_files:LAB",
)
