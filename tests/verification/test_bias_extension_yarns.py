"""A small strip of yarns on the bias, from its cut to its results."""

import numpy as np

from knittest.config.loading import resolve
from knittest.laboratory.bias_extension.strip import strip_of
from knittest.laboratory.bias_extension.test import BiasExtension
from knittest.laboratory.bias_extension.zones import material_points, zone_table
from knittest.solve.state import SILENT


def test_a_knit_on_the_bias_is_sheared_less_than_pin_jointed_yarns_would_be():
    """Yarns bend and slip on their way out of the jaws; what is sheared is the middle, most, and next to it."""
    sets = ("rig.width=15", "rig.gauge_length=30", "rig.max_angle=10.5", "solver.speed=0.4", "solver.ramp=1")
    run = resolve(variant="2", scale="meso", preset="quick", test="bias-extension", sets=sets)
    prepared = BiasExtension().prepare(run)
    history, _ = BiasExtension().solve(prepared, run, SILENT)
    table = zone_table(history, strip_of(run), material_points(run, history))
    late = table["shear_angle_deg"] > 3.0
    for column in ("middle_mean_deg", "slip_percentile_95_mm"):
        assert late.sum() > 5 and (np.diff(table[column][late]) > 0.0).all()
    assert 4.0 < table["middle_mean_deg"][-1] < 10.5
    assert table["middle_mean_deg"][-1] > table["half_mean_deg"][-1] > table["rigid_mean_deg"][-1]
    found = BiasExtension().results(run, prepared, history)
    assert 0.1 < found["bias_force_n_at_deg.10"] < 1.0 and 0.0 < found["crossing_slip_mm_at_deg.10"] < 0.3
    assert history.energies["energy_error"][-1] < 0.01
