"""Record of the biaxial test."""

from knittest.base.kinds import STRIPS, Regression, RegressionRuns, TestKind
from knittest.laboratory.records import TENSION_FIELDS

KIND = TestKind(
    name="biaxial",
    place=3,
    summary="Pull along warp and weft at once, macro or meso.",
    usage="""Pull a square along warp and weft at once, at a given ratio of the strains: force per width both ways.

    Example: knittest biaxial --variant 1 --scale macro --direction warp --ratio 0.5
    """,
    run="knittest.laboratory.biaxial.config:BiaxialRun",
    test="knittest.laboratory.biaxial.test:Biaxial",
    report="knittest.laboratory.biaxial.report:BiaxialReport",
    size=("square of {rig.side:g} mm, the other strain {rig.ratio:g} times that of the {rig.direction}",),
    sheet=("side", "side"),
    shortcuts={"ratio": ("rig.ratio", "Strain of the other system over that of the direction.")},
    labels={
        "biaxial_force_n_per_mm": ("largest force per width [N/mm]", "{:.1f}"),
        "biaxial_strain_pct": ("strain at it [%]", "{:.2f}"),
        "cross_force_n_per_mm": ("largest force per width, other system [N/mm]", "{:.1f}"),
        "cross_strain_pct": ("strain at it, other system [%]", "{:.2f}"),
        "run_speed_m_per_s": ("test speed [m/s]", "{:.3g}"),
    },
    diagnostic=("run_speed_m_per_s",),
    published=("biaxial_force_n_per_mm", "biaxial_strain_pct"),
    pictures=("curve.png", "energies.png", "deformed.png"),
    presets="knittest.laboratory.biaxial.config:settings",
    sizes=("side",),
    deciding={
        "macro": ("macro.tension.{d}", "macro.fracture_strain.{d}", "macro.poisson"),
        "meso": ("warp_density", "weft_density", *TENSION_FIELDS),
    },
    fed=("macro",),
    hinges={"stop_force_ratio": 1},
    converged=0.01,
    studied=True,
    regression=Regression(
        runs=(
            RegressionRuns(7, "quick", "meso", "quick", STRIPS),
            RegressionRuns(8, "quick", "macro", "quick", STRIPS),
            RegressionRuns(4, "full", "meso", "quick", (("2", "warp"),)),
            RegressionRuns(8, "full", "macro", "standard", (("1", "warp"),)),
        )
    ),
    laboratory="knittest.laboratory.biaxial.lab_files:LAB",
)
