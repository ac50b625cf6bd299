"""Shells of a fabric that states yarns and no material card break with these yarns: a glass fabric of drawn numbers."""

import json

import pytest
import yaml

from knittest.cli.main import run as knittest

#: inlays of 800 tex E-glass, loops of 100 tex polyester, per 100 mm 37.8 wales and 26.5 courses
GLASS = {
    "warp_density": 37.8, "weft_density": 26.5, "loop_length": 14.05, "area_mass": 655.2, "thickness": 2.416,
    "reinforcing": {
        "youngs_modulus": 72.0, "load_area": 0.3137, "fracture_strain": 2.2, "beam_diameter": 0.8159,
        "linear_density": 800.0, "bending_stiffness": {"warp": 31.32, "weft": 31.32},
    },
    "knitting": {
        "youngs_modulus": 10.0, "load_area": 0.07246, "fracture_strain": 14.0, "beam_diameter": 0.3921,
        "linear_density": 100.0, "bending_stiffness": 0.2321,
    },
    # of the paths of the cell only those that are pulled are run here
    "macro": {
        "shear": {"kind": "linear", "stiffness": {"value": 0.05, "source": "assumed"}},
        "bending_stiffness": {"warp": 11.8, "weft": 8.3},
    },
}  # fmt: skip


def test_peak_force_of_shells_is_the_bundle_of_the_yarns(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert knittest(["new", "glass"]) == 0
    path = tmp_path / "configs" / "glass.yaml"
    data = yaml.safe_load(path.read_text())
    _lay(data, GLASS)
    path.write_text(yaml.safe_dump(data))
    arguments = ["--variant", "glass", "--scale", "macro", "--preset", "quick", "--no-frames", "--no-pictures"]
    capsys.readouterr()
    assert knittest(["tensile", *arguments, "--json", "--quiet", "--out", "r"]) == 0
    runs = json.loads(capsys.readouterr().out)["runs"]
    yarn = 72e3 * 0.3137 * 0.022
    for run, yarns in zip(runs, (18.9, 13.25), strict=True):
        assert run["results"]["peak_force_n"] == pytest.approx(yarns * yarn, rel=0.02)
        kept = yaml.safe_load((tmp_path / run["folder"] / "config.yaml").read_text())["fabric"]["macro"]
        assert kept["tension"]["warp"]["source"] == kept["fracture_strain"]["warp"]["source"] == "derived"


def _lay(under: dict, over: dict) -> None:
    for name, value in over.items():
        if isinstance(value, dict) and isinstance(under.get(name), dict):
            _lay(under[name], value)
        else:
            under[name] = {"value": value, "source": "assumed"} if isinstance(value, float) else value
