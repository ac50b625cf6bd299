"""Record of the cantilever."""

from knittest.base.kinds import STRIPS, Regression, RegressionRuns, TestKind

#: Eq. 2 converts each to the others
_ROWS = (
    "overhang_mm", "bending_stiffness_mncm2", "bending_stiffness_n_mm_per_width",
    "bending_stiffness_eq2_n_mm_per_width",
)  # fmt: skip

KIND = TestKind(
    name="cantilever",
    place=3,
    summary="Bending under its own weight, macro or meso.",
    usage="""Let a strip bend over an edge under its own weight: chord angle, overhang, bending stiffness.

    Example: knittest cantilever --variant 1 --scale macro --direction warp --set rig.mode=overhang
    """,
    run="knittest.laboratory.cantilever.config:CantileverRun",
    test="knittest.laboratory.cantilever.test:Cantilever",
    report="knittest.laboratory.cantilever.report:CantileverReport",
    size=("strip {rig.width:g} mm wide",),
    sheet="knittest.laboratory.cantilever.test:sheet",
    corrections="knittest.laboratory.cantilever.corrections:CantileverCorrections",
    labels={
        "chord_angle_deg": ("chord angle [deg]", "{:.2f}"),
        "overhang_mm": ("overhang [mm]", "{:.1f}"),
        "bending_stiffness_eq2_n_mm_per_width": ("B by Eq. 2, per width [N mm]", "{:.2f}"),
        "bending_stiffness_n_mm_per_width": ("B at the root, per width [N mm]", "{:.2f}"),
        "moment_error_pct": ("error of the root moment [%]", "{:.2f}"),
        "residual": ("residual of the equilibrium [-]", "{:.2g}"),
        "curl_moment_nmm": ("moment against curl [N mm]", "{:.3f}"),
        "drift_deg": ("last change of the chord angle [deg]", "{:.2f}"),
    },
    diagnostic=("residual", "moment_error_pct", "drift_deg"),
    published=_ROWS,
    other_names=dict.fromkeys(_ROWS, "overhang"),
    pictures=("curve.png", "deformed.png"),
    scale="macro",  # bending is an input of both scales
    presets="knittest.laboratory.cantilever.config:settings",
    sizes=("width",),
    deciding={
        "macro": ("macro.bending_stiffness.{d}", "area_mass"),
        "meso": ("reinforcing.bending_stiffness.{d}", "area_mass"),
    },
    fed=("macro", "meso"),
    origin="knittest.laboratory.cantilever.config:CantileverOrigin",
    hinges={"tolerance": 1, "membrane_share": -1},
    # macro: the residual of the equilibrium; meso, where it is fixed: the step
    halved={"macro": ("rig.tolerance", "-"), "meso": ("solver.safety", "-")},
    studied=True,
    regression=Regression(
        rows=("overhang_mm", "bending_stiffness_eq2_n_mm_per_width"),
        sets=("rig.mode=overhang",),  # as in the laboratory; the paper's simulation is given the overhang
        runs=(
            RegressionRuns(2, "quick", "meso", "quick", STRIPS, ("rig.mode=angle",), "angle"),
            RegressionRuns(5, "quick", "macro", "quick", STRIPS),
            RegressionRuns(2, "full", "meso", "paper", STRIPS),
            RegressionRuns(6, "full", "macro", "paper", STRIPS),
        ),
    ),
    laboratory="knittest.laboratory.cantilever.lab_files:LAB",
)
