"""Axial law of single yarns and strength of bundles."""

import numpy as np
import pytest
from yarn_cases import card, yarns

from knittest.fabric.topology import YarnDraws, bundle_peak
from knittest.kernels.monitor import axial_state


def test_tabulated_law_and_slack_carry_what_the_table_says():
    run = card(
        "model.meso.contact=false", "fabric.reinforcing.law={kind: table, points: [[0, 0], [0.4, 80], [1.2, 500]]}"
    )
    area = run.fabric.reinforcing.load_area_mm2
    line = np.column_stack([np.zeros(5), np.arange(5.0), np.zeros(5)])
    loose = {"warp": YarnDraws(np.full(1, 1.0), np.full(1, 0.001), np.ones(1), np.full(1, 0.5))}
    model = yarns(run, line, draws=loose)
    for strain, stress in ((0.0005, 0.0), (0.003, 40.0), (0.009, 290.0)):
        model.nodes.position[1, :5] = (1.0 + strain) * np.arange(5.0)
        force = axial_state(model.nodes, model.parts, model.beams)[1, 1]
        assert force == pytest.approx(stress * area, abs=1e-9)


def test_bundle_formula_is_daniels():
    strains = np.array([0.008, 0.012, 0.009, 0.011])
    draws = YarnDraws(strains, np.zeros(4), np.ones(4), np.full(4, 0.5))
    expected = max(46.5e3 * e * (4 - k) for k, e in enumerate(np.sort(strains)))
    assert bundle_peak(draws, 46.5e3)[0] == pytest.approx(expected)
