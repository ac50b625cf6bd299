"""Fabrics that `knittest new` makes of thin knitting yarns: their cells can be sheared at the first attempt."""

import json

import pytest

from knittest.cli.main import run
from knittest.config.loading import resolve
from knittest.config.templates import new_fabric_text


@pytest.mark.parametrize(
    ("reinforcing", "knitting"), [("E-glass 600 tex", "polyester 30 tex"), ("carbon HT 800 tex", "polyester 50 tex")]
)
def test_the_shear_of_a_new_fabric_passes_its_quality_checks(tmp_path, capsys, reinforcing, knitting):
    """A fixed residual of the relaxed cell, late contacts and the loop length of variant 1 made it fail."""
    path = tmp_path / "thin.yaml"
    yarns = {"reinforcing": reinforcing, "knitting": knitting}
    path.write_text(new_fabric_text("thin", resolve(variant="1").fabric, yarns=yarns), encoding="utf-8")
    options = ["--preset", "quick", "--set", "rig.max_angle=42.5", "--out", str(tmp_path / "run")]
    assert run(["cell", "--fabric", str(path), *options, "--json", "--no-frames", "--no-pictures"]) == 0
    done = json.loads(capsys.readouterr().out)
    assert done["refused"] == [] and done["rest"]["loop_tension_n"] > 0.0
    assert done["rest"]["out_of_balance_pct"] < 1.0
