"""Record of the friction test."""

from knittest.base.kinds import STRIPS, Regression, RegressionRuns, TestKind

#: strip of yarns for the quick level of the regression: two thirds of the plates under the same pressure. On half of
#: that the normal force is off by more than 1 % when a course leaves them
_SHORT = ("rig.length=110", "rig.plate_length=96", "rig.normal_force=384")

KIND = TestKind(
    name="friction",
    place=4,
    tools=True,
    summary="Pull-out between two plates, macro or meso.",
    usage="""Pull a strip out between two plates pressed together: pull force, friction coefficient.

    Example: knittest friction --variant 1 --scale macro --direction warp
    """,
    run="knittest.laboratory.friction.config:FrictionRun",
    test="knittest.laboratory.friction.test:Friction",
    report="knittest.laboratory.friction.report:FrictionReport",
    size="knittest.laboratory.friction.config:size_texts",
    sheet=("length", "width"),
    labels={
        "pull_force_kinetic_n": ("pull force, kinetic [N]", "{:.1f}"),
        "pull_force_static_n": ("pull force, largest [N]", "{:.1f}"),
        "mu_paper": ("F_R/F_N, two faces [-]", "{:.4f}"),
        "mu_per_face": ("F_R/(2 F_N), a face [-]", "{:.4f}"),
        "normal_force_n": ("normal force [N]", "{:.1f}"),
        "normal_force_error_pct": ("largest normal force error [%]", "{:.2f}"),
        "compression_mm": ("plates closed by [mm]", "{:.3f}"),
        "pressure_mean_mpa": ("mean pressure [MPa]", "{:.3f}"),
        "pressure_peak_mpa": ("largest pressure of a cell [MPa]", "{:.2f}"),
        "plate_load_on_warp_pct": ("plates' load on warp yarns [%]", "{:.1f}"),
        "plate_load_on_weft_pct": ("plates' load on weft yarns [%]", "{:.1f}"),
        "plate_load_on_knit_pct": ("plates' load on loops [%]", "{:.1f}"),
        "plate_penetration_um": ("deepest penetration of a plate [um]", "{:.2f}"),
        "element_deformation_um": ("largest deformation of an element [um]", "{:.1f}"),
        "penetration_over_deformation_pct": ("penetration over deformation [%]", "{:.1f}"),
        "run_speed_m_per_s": ("test speed [m/s]", "{:.3g}"),
    },
    diagnostic=(
        "normal_force_error_pct", "plate_penetration_um", "element_deformation_um", "penetration_over_deformation_pct",
        "run_speed_m_per_s",
    ),
    published=("pull_force_kinetic_n", "pull_force_static_n", "mu_paper", "mu_per_face"),
    measured={"static_coefficient": "mu_static_per_face", "kinetic_coefficient": "mu_per_face"},
    pictures=("curve.png", "energies.png", "pressure.png"),
    tables=("pressure.csv",),
    presets="knittest.laboratory.friction.config:settings",
    sizes=("width",),
    deciding={"macro": ("rig.kinetic_coefficient",), "meso": ("rig.kinetic_coefficient",)},
    fed=("macro", "meso"),
    hinges={"membrane_share": -1},
    origin="knittest.laboratory.friction.config:FrictionOrigin",
    studied=True,
    regression=Regression(
        rows=("mu_paper",),
        runs=(
            RegressionRuns(
                1, "quick", "meso", "quick", (("1", "warp"), ("2", "warp")), (*_SHORT, "rig.travel=5"), "96mm"
            ),
            RegressionRuns(
                1, "quick", "meso", "quick", (("1", "weft"), ("2", "weft")), (*_SHORT, "rig.travel=6"), "96mm"
            ),
            RegressionRuns(6, "quick", "macro", "quick", STRIPS),
            RegressionRuns(3, "full", "meso", "paper", (("1", "warp"),)),
            RegressionRuns(7, "full", "macro", "paper", (("1", "warp"), ("2", "warp"))),
        ),
        # a step changed by 1e-9 of itself moves numbers of yarns by 0.9 %, the curve by 1.3 % and the largest pressure
        # of a cell by 19 %, because single loops at the edges of variant 1 let go sooner or later
        drift={"meso": (0.03, 0.04, 0.5)},
        buckled=("pressure_peak_mpa", "element_deformation_um", "penetration_over_deformation_pct"),
    ),
    laboratory="knittest.laboratory.friction.lab_files:LAB",
)  # fmt: skip
