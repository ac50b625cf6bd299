"""Record of the cell test."""

from knittest.base.kinds import SHEETS, Regression, RegressionRuns, TestKind
from knittest.laboratory.records import CROSSINGS, LOOPS, labels_at

KIND = TestKind(
    name="cell",
    shears=True,
    place=4,
    periodic=True,
    directional=False,
    summary="One periodic cell of yarns under a mean deformation, meso.",
    usage="""Deform one periodic cell of yarns: mean stress, energy by mechanism, forces of crossings, thickness.

    Example: knittest cell --variant 1 --path shear
    """,
    run="knittest.laboratory.cell.config:CellRun",
    test="knittest.laboratory.cell.test:Cell",
    report="knittest.laboratory.cell.report:CellReport",
    size=("{rig.wales} x {rig.courses} repeats without an edge, path {rig.path}",),
    ending="knittest.laboratory.cell.path:path_end",
    texts={"path": ("rig.path", "shear, warp, weft, biaxial, bending, compaction, or a CSV file of steps.")},
    labels={
        "cell_shear_n_per_mm_at_deg.1": ("shear force at 1 deg [N/mm]", "{:.5f}"),
        **labels_at("cell_shear_n_per_mm_at_deg", "shear force at {} deg [N/mm]", "{:.4f}", (10, 20, 30, 40)),
        "cell_warp_n_per_mm": ("mean stress along the warp [N/mm]", "{:.3f}"),
        "cell_weft_n_per_mm": ("mean stress along the weft [N/mm]", "{:.3f}"),
        "cell_moment_n": ("bending moment per length [N]", "{:.4f}"),
        "cell_bending_stiffness_n_mm": ("bending stiffness [N mm]", "{:.3f}"),
        "cell_curl_per_mm": ("curl of the free fabric, + concave on the face [1/mm]", "{:+.4f}"),
        "cell_fracture_strain_pct": ("strain at the first fracture of a yarn [%]", "{:.3f}"),
        "cell_pressure_kpa": ("pressure at the end [kPa]", "{:.1f}"),
        "cell_thickness_at_rest_mm": ("thickness at the start [mm]", "{:.3f}"),
        "cell_thickness_mm": ("thickness at the end [mm]", "{:.3f}"),
        "cell_friction_share": ("share of friction in the work", "{:.3f}"),
        "run_speed_m_per_s": ("test speed [m/s]", "{:.3g}"),
    },
    diagnostic=("run_speed_m_per_s",),
    pictures=("curve.png", "energies.png", "deformed.png"),
    scales=("meso",),
    presets="knittest.laboratory.cell.config:settings",
    sizes=("wales", "courses"),
    deciding={"meso": ("warp_density", "weft_density", *LOOPS, *CROSSINGS)},
    hinges={"membrane_share": -1},
    regression=Regression(runs=(RegressionRuns(5, "quick", "meso", "quick", SHEETS),)),
)
