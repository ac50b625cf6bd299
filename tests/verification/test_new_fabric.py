"""Fabrics that `knittest new` makes: cells of thin knitting yarns can be sheared, and cells of all structures relax, at
the first attempt.
"""

import json

import pytest

from knittest.base.files import structures
from knittest.cli.main import run
from knittest.config.loading import resolve
from knittest.config.structure_template import new_structure_text
from knittest.config.templates import new_fabric_text

PAIRS = [("carbon HT 800 tex", "polyester 100 tex"), ("E-glass 300 tex", "polyester 50 tex")]


@pytest.mark.parametrize("structure", structures())
@pytest.mark.parametrize(("reinforcing", "knitting"), PAIRS)
def test_a_new_fabric_of_each_structure_relaxes(tmp_path, capsys, structure, reinforcing, knitting):
    """Thicker and thinner yarns than those of the shipped files."""
    yarns = {"knitting": knitting}
    if resolve(variant=structure).fabric.inlays:
        yarns["reinforcing"] = reinforcing
    path = tmp_path / "own.yaml"
    path.write_text(new_structure_text("own", structure, yarns=yarns), encoding="utf-8")
    assert run(["fabric", "relax", "--fabric", str(path)]) == 0
    assert "interlacing           checked" in capsys.readouterr().out


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
