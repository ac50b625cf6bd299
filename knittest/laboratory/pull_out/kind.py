"""Record of the pull-out test."""

from knittest.base.kinds import STRIPS, Regression, RegressionRuns, TestKind
from knittest.laboratory.records import LOOPS

KIND = TestKind(
    name="pull-out",
    place=5,
    summary="Pull of one inlay out of the fabric, meso.",
    usage="""Pull one inlay out of a piece of fabric: largest force, force while it slides, friction of a crossing.

    Example: knittest pull-out --variant 1 --direction weft
    """,
    run="knittest.laboratory.pull_out.config:PullOutRun",
    test="knittest.laboratory.pull_out.test:PullOut",
    report="knittest.laboratory.pull_out.report:PullOutReport",
    size="knittest.laboratory.pull_out.config:size_texts",
    labels={
        "pull_out_at_rest_n": ("force at which the inlay begins to slide [N]", "{:.3f}"),
        "pull_out_peak_n": ("largest force of the inlay [N]", "{:.3f}"),
        "pull_out_sliding_n": ("force of the inlay while it slides [N]", "{:.3f}"),
        "crossing_friction_at_rest_n": ("friction of a crossing at rest, mu N [N]", "{:.4f}"),
        "crossing_friction_n": ("friction of a crossing while it slides, mu N [N]", "{:.4f}"),
        "crossing_normal_force_n": ("normal force of a crossing while it slides, N [N]", "{:.4f}"),
        "crossings": ("crossings at the start", "{:.0f}"),
        "slid_mm": ("slide of the inlay [mm]", "{:.2f}"),
        "clamp_difference_pct": ("difference of the clamp forces [%]", "{:.2f}"),
        "run_speed_m_per_s": ("test speed [m/s]", "{:.3g}"),
    },
    diagnostic=("crossings", "slid_mm", "clamp_difference_pct", "run_speed_m_per_s"),
    published=(
        "pull_out_at_rest_n", "pull_out_peak_n", "pull_out_sliding_n", "crossing_friction_at_rest_n",
        "crossing_friction_n",
    ),
    pictures=("curve.png", "energies.png", "deformed.png"),
    scales=("meso",),
    presets="knittest.laboratory.pull_out.config:settings",
    sizes=("width", "length", "travel"),
    # by their powers in the forces: docs/identify.md, where crimp and the inlays' own stiffness have hardly any
    deciding={
        "meso": (
            "warp_density", "weft_density", *LOOPS, "knitting.torsion_ratio", "knitting.loop_shortening",
            "knitting.tension", "reinforcing.beam_diameter", "contact.friction_coefficient",
        ),
    },
    hinges={"membrane_share": -1},
    regression=Regression(
        runs=(RegressionRuns(2, "quick", "meso", "quick", STRIPS, ("rig.travel=4",), "4mm", enlarges=True),)
    ),
    laboratory="knittest.laboratory.pull_out.lab_files:LAB",
)  # fmt: skip
