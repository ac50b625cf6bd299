"""Record of the forming test."""

from knittest.base.kinds import SHEETS, Regression, RegressionRuns, TestKind
from knittest.laboratory.records import CROSSINGS, LOOPS

#: blanks for the quick level of the regression: of shells without a holder, and of yarns, which need one
_FREE = (
    "rig.blank_length=150", "rig.blank_width=150", "rig.stamp.kind=hemisphere", "rig.stamp.hemisphere.radius=25",
    "rig.depth=20",
)  # fmt: skip
_SMALL = (
    "rig.blank_length=40", "rig.blank_width=40", "rig.stamp.kind=hemisphere", "rig.stamp.hemisphere.radius=8",
    "rig.die.clearance=5", "rig.holder.clearance=5", "rig.depth=5", "rig.blank_holder_force=150",
)  # fmt: skip

KIND = TestKind(
    name="forming",
    shears=True,
    place=5,
    tools=True,
    directional=False,
    summary="Form a blank with stamp and die, macro or meso.",
    usage="""Form a blank with a T, a hemisphere or STL files: shear angles, wrinkles, draw-in, yarn forces.

    Example: knittest forming --variant 1 --scale macro --blank-holder-force 100
    """,
    shortcuts={"blank-holder-force": ("rig.blank_holder_force", "Force on the blank holder [N].  [default: 0, none]")},
    run="knittest.laboratory.forming.config:FormingRun",
    test="knittest.laboratory.forming.test:Forming",
    report="knittest.laboratory.forming.report:FormingReport",
    deck_force="rcforc, contacts with the stamp, along z",
    checked="knittest.laboratory.forming.tool_check:check_tools",
    size="knittest.laboratory.forming.config:size_texts",
    sheet=("blank_length", "blank_width"),
    labels={
        "stamp_force_max_n": ("stamp force, largest [N]", "{:.1f}"),
        "max_shear_angle_deg": ("shear angle, largest [deg]", "{:.1f}"),
        "max_wrinkle_height_mm": ("wrinkle of the flange, largest [mm]", "{:.2f}"),
        "wrinkled_area_pct": ("flange above half the thickness [%]", "{:.1f}"),
        "draw_in_max_mm": ("draw-in, largest [mm]", "{:.1f}"),
        "max_yarn_force_n": ("yarn force, largest [N]", "{:.2f}"),
        "max_yarn_utilisation_pct": ("yarn force over strength [%]", "{:.2f}"),
        "yarns_at_risk": ("yarns at risk", "{:.0f}"),
        "shear_angle_p95_deg": ("shear angle, 95th percentile [deg]", "{:.1f}"),
        "shear_angle_inner_corners_p95_deg": ("shear angle at inner corners, 95th percentile [deg]", "{:.1f}"),
        "shear_angle_elsewhere_p95_deg": ("shear angle elsewhere, 95th percentile [deg]", "{:.1f}"),
        "wrinkle_height_p95_mm": ("wrinkle of the flange, 95th percentile [mm]", "{:.2f}"),
        "rim_wave_height_mm": ("wave of the rim, crest over trough, largest [mm]", "{:.2f}"),
        "rim_wave_count": ("waves of the rim", "{:.0f}"),
        "off_stamp_area_pct": ("bottom off the stamp by half the thickness [%]", "{:.1f}"),
        "draw_in_warp_mm": ("draw-in, warp ends, middle [mm]", "{:.1f}"),
        "draw_in_weft_mm": ("draw-in, weft ends, middle [mm]", "{:.1f}"),
        "tool_penetration_max_um": ("deepest penetration of a tool [um]", "{:.1f}"),
        "max_membrane_strain_pct": ("strain of a shell, largest [%]", "{:.2f}"),
        "crossings_out_of_order": ("crossings out of order", "{:.0f}"),
    },
    diagnostic=("tool_penetration_max_um",),
    pictures=(
        "curve.png", "energies.png", "deformed.png", "shear-angle.png", "wrinkles.png", "draw-in.png",
        "yarn-forces.png", "stamp-work.png",
    ),
    tables=("draw-in.csv", "yarn-forces.csv", "shear-field.csv", "height-field.csv", "stamp-work.csv"),
    scale="macro",  # a whole blank takes minutes
    presets="knittest.laboratory.forming.config:settings",
    sizes=("blank_length", "blank_width", "depth"),
    deciding={
        "macro": (
            "macro.shear", "macro.tension.warp", "macro.tension.weft", "macro.bending_stiffness.warp",
            "macro.bending_stiffness.weft", "macro.in_plane_bending.warp", "macro.in_plane_bending.weft",
            "macro.poisson",
        ),
        "meso": (
            "warp_density", "weft_density", *LOOPS, *CROSSINGS,
            "reinforcing.bending_stiffness.warp", "reinforcing.bending_stiffness.weft",
        ),
    },
    origin="knittest.laboratory.forming.config:FormingOrigin",
    checks=("drag_over_weight",),
    advice="knittest.laboratory.forming.rig:ADVICE",
    hinges={"membrane_share": -1},
    # shells without a stored scatter: an unevenness changed by 2e-9 of itself changes numbers by 1.7 %, the curve by
    # 0.8 % and the buckles by 3.9 %
    regression=Regression(
        runs=(
            RegressionRuns(1, "quick", "meso", "quick", SHEETS, _SMALL, "40mm", enlarges=True),
            RegressionRuns(1, "quick", "macro", "quick", SHEETS, _FREE, "150mm"),
            RegressionRuns(
                1, "quick", "macro", "quick", (("1", None),), ("rig.blank_holder_force=100",), "100n", enlarges=True
            ),
            RegressionRuns(0, "full", "meso", "paper", (("1", None),), ("rig.blank_holder_force=100",), "100n"),
            RegressionRuns(2, "full", "macro", "paper", (("1", None),), ("rig.blank_holder_force=100",), "100n"),
        ),
        drift={"macro": (0.04, 0.02, 0.10)},
        buckled=("max_wrinkle_height_mm", "wrinkle_height_p95_mm", "rim_wave_height_mm"),
        crests=("rim_wave_count",),
    ),
)  # fmt: skip
