"""Record of the cantilever."""

from knittest.base.kinds import STRIPS, Regressed, Regression, TestKind

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
    size="knittest.laboratory.cantilever.test:stated",
    sheet="knittest.laboratory.cantilever.test:sheet",
    corrections="knittest.laboratory.cantilever.corrections:CantileverCorrections",
    labels={
        "chord_angle_deg": ("chord angle [deg]", "{:.2f}"),
        "overhang_mm": ("overhang [mm]", "{:.1f}"),
        "bending_stiffness_eq2_n_mm_per_width": ("B by Eq. 2, per width [N mm]", "{:.2f}"),
        "bending_stiffness_n_mm_per_width": ("B at the root, per width [N mm]", "{:.2f}"),
        "moment_error_pct": ("root moment off [%]", "{:.2f}"),
        "residual": ("out of balance [-]", "{:.2g}"),
        "curl_moment_nmm": ("curl, held [N mm]", "{:.3f}"),
        "drift_deg": ("last chord drift [deg]", "{:.2f}"),
    },
    diagnostic=("residual", "moment_error_pct", "drift_deg"),
    published=(
        "overhang_mm",
        "bending_stiffness_mncm2",
        "bending_stiffness_n_mm_per_width",
        "bending_stiffness_eq2_n_mm_per_width",
    ),
    # Eq. 2 makes one of the other
    other_names={
        "overhang_mm": "overhang",
        "bending_stiffness_mncm2": "overhang",
        "bending_stiffness_eq2_n_mm_per_width": "overhang",
        "bending_stiffness_n_mm_per_width": "overhang",
    },
    pictures=("curve.png", "deformed.png"),
    scale="macro",  # bending is an input of both, which the shells are faster to confirm
    presets="knittest.laboratory.cantilever.config:settings",
    sizes=("width",),
    deciding={
        "macro": ("macro.bending_stiffness.{d}", "area_mass"),
        "meso": ("reinforcing.bending_stiffness.{d}", "area_mass"),
    },
    fed=("macro", "meso"),
    origin="knittest.laboratory.cantilever.config:CantileverOrigin",
    hinges={"tolerance": 1, "membrane_share": -1},
    # at rest: the residual of shells; of yarns, whose balance at rest is fixed, the step
    halved={"macro": ("rig.tolerance", "-"), "meso": ("solver.safety", "-")},
    studied=True,
    regression=Regression(
        rows=("overhang_mm", "bending_stiffness_eq2_n_mm_per_width"),
        sets=("rig.mode=overhang",),  # the laboratory's cantilever finds the overhang; the paper's is given it
        runs=(
            Regressed(2, "quick", "meso", "quick", STRIPS, ("rig.mode=angle",), "angle"),
            Regressed(5, "quick", "macro", "quick", STRIPS),
            Regressed(2, "full", "meso", "paper", STRIPS),
            Regressed(6, "full", "macro", "paper", STRIPS),
        ),
    ),
    laboratory="knittest.laboratory.cantilever.lab_files:LAB",
)
