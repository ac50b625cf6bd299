"""Record of the bias extension test."""

from knittest.base.kinds import SHEETS, Regression, RegressionRuns, TestKind
from knittest.laboratory.records import CROSSINGS, LOOPS, labels_at

#: shear angles at which forces are compared [deg]
_ANGLES = (10, 20, 30, 40)

KIND = TestKind(
    name="bias-extension",
    shears=True,
    place=3,
    directional=False,
    summary="Pull of a strip cut at 45 deg to its yarns, macro or meso.",
    usage="""Pull a strip cut at 45 deg to its yarns: force, normalised shear force, shear angles of its zones.

    Example: knittest bias-extension --variant 1 --scale macro
    """,
    run="knittest.laboratory.bias_extension.config:BiasExtensionRun",
    test="knittest.laboratory.bias_extension.test:BiasExtension",
    report="knittest.laboratory.bias_extension.report:BiasExtensionReport",
    size=("strip on the bias {rig.width:g} mm wide, {rig.gauge_length:g} mm between the clamps",),
    sheet="knittest.laboratory.bias_extension.config:sheet",
    labels={
        **labels_at("bias_force_n_at_deg", "force on the bias at {} deg [N]", "{:.2f}", _ANGLES),
        **labels_at(
            "bias_normalised_force_n_per_mm_at_deg", "normalised, on the bias, at {} deg [N/mm]", "{:.4f}", _ANGLES
        ),
        **labels_at("middle_shear_angle_deg_at_deg", "shear of the middle at {} deg [deg]", "{:.2f}", _ANGLES),
        **labels_at("crossing_slip_mm_at_deg", "slip of 95 % where yarns cross, at {} deg [mm]", "{:.3f}", _ANGLES),
        "run_speed_m_per_s": ("test speed [m/s]", "{:.3g}"),
    },
    sized={f"bias_force_n_at_deg.{a}": f"bias_normalised_force_n_per_mm_at_deg.{a}" for a in _ANGLES},
    published=tuple(f"bias_normalised_force_n_per_mm_at_deg.{a}" for a in _ANGLES),
    diagnostic=("run_speed_m_per_s",),
    pictures=("curve.png", "energies.png", "zones.png", "deformed.png"),
    tables=("zones.csv",),
    presets="knittest.laboratory.bias_extension.config:settings",
    sizes=("gauge_length", "width"),
    deciding={"macro": ("macro.shear",), "meso": ("warp_density", "weft_density", *LOOPS, *CROSSINGS)},
    hinges={"membrane_share": -1},
    sheared_to="rig.max_angle",
    studied=True,
    regression=Regression(
        runs=(
            RegressionRuns(
                2,
                "quick",
                "meso",
                "quick",
                (("1", None),),
                ("rig.width=20", "rig.gauge_length=40"),
                "20mm",
                enlarges=True,
            ),
            RegressionRuns(1, "quick", "meso", "quick", (("2", None),), enlarges=True),
            RegressionRuns(7, "quick", "macro", "quick", SHEETS),
            RegressionRuns(4, "full", "meso", "quick", (("2", None),), enlarges=True),
            RegressionRuns(8, "full", "macro", "standard", (("1", None),)),
        )
    ),
    laboratory="knittest.laboratory.bias_extension.lab_files:LAB",
)
