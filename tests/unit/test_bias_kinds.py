"""Worth of the rows of bias extension and biaxial tests: predicted from a frame's law, assumed, or given."""

from knittest.config.loading import resolve
from knittest.experiment.origin import assumed_inputs, row_kind

FORCE, NORMALISED = "biaxial_force_n_per_mm", "bias_normalised_force_n_per_mm_at_deg.30"


def test_a_law_from_a_frame_predicts_the_bias_extension():
    run = resolve(variant="cao2008-weave", scale="macro", preset="quick", test="bias-extension")
    assert row_kind(run, NORMALISED) == "predicted"


def test_uncoupled_shells_return_their_curves_if_nobody_assumed_them_uncoupled():
    found = {}
    for source in ("assumed", "measured"):
        sets = (f"fabric.macro.poisson={{value: 0.0, source: {source}, ref: strips}}",)
        run = resolve(variant="1", scale="macro", preset="quick", test="biaxial", direction="warp", sets=sets)
        found[source] = row_kind(run, FORCE), assumed_inputs(run)
    assert found == {"assumed": ("assumed", ("macro.poisson",)), "measured": ("input", ())}
