"""``knittest new --structure``: the file has the stitches and layers of a shipped structure, and the yarns given."""

from pathlib import Path

import pytest

from knittest.base.errors import InputError
from knittest.base.files import structures
from knittest.cli.main import run
from knittest.config.loading import resolve
from knittest.config.structure_template import new_structure_text

YARNS = {"reinforcing": "E-glass 300 tex", "knitting": "polyester 50 tex"}


def test_the_shipped_structures():
    assert {"weft-only", "90-0-90-0", "rib", "seed"} <= set(structures())
    assert not {"pham2019-v1", "pham2019-v2", "cao2008-weave"} & set(structures())


@pytest.mark.parametrize("structure", structures())
def test_a_new_fabric_has_stitches_and_layers_of_its_structure(tmp_path: Path, structure: str):
    path = tmp_path / "own.yaml"
    path.write_text(new_structure_text("own", structure), encoding="utf-8")
    own, like = resolve(fabric=path).fabric, resolve(variant=structure).fabric
    assert own.name == "own"
    assert (own.grid, [(one.name, one.pattern) for one in own.inlays]) == (
        like.grid,
        [(one.name, one.pattern) for one in like.inlays],
    )
    assert own.loop_length.value == like.loop_length.value and own.loop_length.ref == f"as {structure}"
    fields = [line for line in path.read_text().splitlines() if line and not line.startswith("#")]
    assert [line.partition(":")[0] for line in fields[:4]] == ["name", "title", "stitches", "layers"]
    assert len(fields) < 15 and max(map(len, path.read_text().splitlines())) <= 120


def test_densities_and_loops_follow_the_yarns_of_all_layers(tmp_path: Path):
    """Carbon of 400 tex and glass of 300 or 600 tex, as circles, between two knitting yarns."""
    path = tmp_path / "own.yaml"
    path.write_text(new_structure_text("own", "two-yarns", yarns=YARNS), encoding="utf-8")
    own, like = resolve(fabric=path).fabric, resolve(variant="two-yarns").fabric
    assert own.layers[0].yarn.fibre == "carbon HT" and own.layers[0].yarn.linear_density.value == 400
    assert own.reinforcing.linear_density.value == 300 and own.knitting.linear_density.value == 50
    rooms = [
        0.5 * sum(i.yarn.beam_diameter.value for i in f.inlays) + 2 * f.knitting.beam_diameter.value
        for f in (own, like)
    ]
    factor = rooms[0] / rooms[1]
    assert own.loop_length.value == pytest.approx(14.4 * factor, rel=0.005)
    assert own.warp_density.value == own.weft_density.value == pytest.approx(28 / factor, rel=0.005)
    assert own.loop_length.ref == "as two-yarns, scaled by the yarn diameters"


def test_wrong_structures_and_yarns_are_named():
    with pytest.raises(InputError, match=r"--structure ribb: no such structure; expected one of .*garter.*, rib, "):
        new_structure_text("own", "ribb")
    with pytest.raises(InputError, match=r"no layer of jersey uses fabric\.reinforcing; leave it out"):
        new_structure_text("own", "jersey", yarns=YARNS)
    with pytest.raises(InputError, match="expected a fibre and its linear density"):
        new_structure_text("own", "weft-only", yarns={"knitting": "polyester"})


def test_the_command_writes_fabric_and_rig(tmp_path: Path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert run(["new", "mine", "--structure", "weft-only", "--knitting", "polyester 50 tex"]) == 0
    assert {one.name for one in Path("configs").iterdir()} == {"mine.yaml", "mine-tensile.yaml"}
    assert resolve(variant="mine").fabric.stitches == ["kp"]
    assert run(["new", "other", "--structure", "interlock"]) == 2
    assert "no such structure" in capsys.readouterr().err


def test_imported_numbers_replace_those_of_the_structure(tmp_path: Path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    part = tmp_path / "import"
    part.mkdir()
    (part / "fabric.yaml").write_text(
        "name: x\nthickness: {value: 2.4, source: measured, ref: 10 places}\n"
        "macro:\n  bending_stiffness:\n    warp: {value: 4.5, source: derived, ref: overhang}\n"
        "    weft: {value: 4.5, source: derived, ref: overhang}\n"
    )
    path = tmp_path / "own.yaml"
    path.write_text(new_structure_text("own", "weft-only", folder=part), encoding="utf-8")
    own = resolve(fabric=path).fabric
    assert own.thickness.source == "measured" and own.macro.bending_stiffness.warp.value == 4.5
    assert own.stitches == ["kp"] and own.area_mass.source == "derived"


def test_a_misspelt_field_makes_no_derived_field_missing(tmp_path):
    """Area mass and thickness follow from the yarns of a file that is valid otherwise."""
    text = structures()["weft-only"].read_text().replace("loop_length:", "loop_lenght:")
    path = tmp_path / "mine.yaml"
    path.write_text(text)
    with pytest.raises(InputError) as error:
        resolve(fabric=path, scale="meso")
    assert "loop_lenght" in str(error.value)
    assert "area_mass" not in str(error.value) and "thickness" not in str(error.value)
