"""Old names of fields and parameter sets: the run of the present names, and a warning with file and line."""

from dataclasses import replace

import numpy as np
import pytest
from pydantic import BaseModel

from knittest.base.errors import InputError
from knittest.base.files import configs_dir
from knittest.config.aliases import FIELDS, OldNameWarning
from knittest.config.loading import resolve
from knittest.config.run import RUNS
from knittest.config.schema import field_lines
from knittest.config.settings import parse_set
from knittest.config.yaml_loader import load_yaml, parse_document
from knittest.pose import Chain, round_section
from knittest.report_page.files import Summary


def test_old_fields_of_a_config_give_the_same_run(tmp_path):
    old, new = tmp_path / "old.yaml", tmp_path / "new.yaml"
    old.write_text("rig: {kind: cell, path: warp}\nsolver:\n  max_force_free: 9\n")
    new.write_text("rig: {kind: cell, path: warp}\nsolver:\n  max_force_free_overlap: 9\n")
    sets = ["rig.torn=ends", "fabric.knitting.draw_in=1"]
    with pytest.warns(OldNameWarning) as found:
        first = resolve(variant="1", config=old, sets=sets)
    assert first == resolve(variant="1", config=new, sets=["rig.at_fracture=ends", "fabric.knitting.loop_shortening=1"])
    texts = [str(one.message) for one in found]
    assert any(f"{old}:3: max_force_free is now called max_force_free_overlap; write" in text for text in texts)
    assert any("--set rig.torn: rig.torn is now called rig.at_fracture" in text for text in texts)


def test_names_below_parameter_sets_rigs_and_with_dots(tmp_path):
    file = tmp_path / "f.yaml"
    file.write_text(
        "parameter_sets: {a: {knitting: {draw_in: 1}}}\nrigs: {pull-out: {warp: {clamped: far}}}\n"
        "differ: [fabric.knitting.draw_in, rig.width]\ngrid:\n  rig.width: [20]\n  rig.torn: [ends]\nslide: 1\n"
    )
    with pytest.warns(OldNameWarning):
        document = load_yaml(file)
    assert document.data == {
        "parameter_sets": {"a": {"knitting": {"loop_shortening": 1}}},
        "rigs": {"pull-out": {"warp": {"clamped_edges": "far"}}},
        "differing_fields": ["fabric.knitting.loop_shortening", "rig.width"],
        "grid": {"rig.width": [20], "rig.at_fracture": ["ends"]},
        "slide": 1,
    }
    assert document.place_of(("grid", "rig.at_fracture")) == f"{file}:6"
    assert document.place_of(("parameter_sets", "a", "knitting", "loop_shortening")) == f"{file}:1"


def test_an_old_parameter_set_is_the_present_one():
    with pytest.warns(OldNameWarning, match="parameter set gripping is now called spin-friction"):
        old = resolve(variant="1", parameters="gripping")
    assert old == resolve(variant="1", parameters="spin-friction")


def test_a_copied_fabric_with_the_old_set_answers_to_the_present_name(tmp_path):
    shipped, own = (configs_dir() / "fabrics/pham2019-v1.yaml").read_text(), tmp_path / "own.yaml"
    own.write_text(shipped.replace("  spin-friction:", "  gripping:"))
    with pytest.warns(OldNameWarning, match="the fabric file: parameter set gripping is now called spin-friction"):
        run = resolve(fabric=own, parameters="spin-friction")
    assert run.fabric == resolve(variant="1", parameters="spin-friction").fabric


def test_the_warning_is_placed_at_the_caller():
    with pytest.warns(OldNameWarning) as found:
        parse_set("rig.torn=ends")
        parse_document("rig: {torn: ends}", "x")
    assert {one.filename for one in found} == {__file__}


def test_a_chain_with_the_old_field_is_the_present_one():
    points, section = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]]), round_section(60e3, 0.75, 2.5e-3)
    with pytest.warns(OldNameWarning, match="Chain: draw_in is now called loop_shortening"):
        old = Chain(points, section, draw_in=0.01)
    assert old == Chain(points, section, loop_shortening=0.01) and replace(old, part=1).loop_shortening == 0.01


def test_numbers_of_an_old_summary_have_present_names():
    rest = Summary.model_validate({"rest": {"draw_in_pct": 1.0, "munden_kc": 5.0}}).rest
    assert rest == {"loop_shortening_pct": 1.0, "munden_kc": 5.0}


def test_present_names_give_no_warning_and_no_old_name_is_a_field(recwarn):
    parse_document("rig: {torn: 1}".replace("torn", "at_fracture"), "x")
    assert parse_set("model.scale=meso").path == ("model", "scale") and not recwarn.list
    assert not set(FIELDS.values()) & {old for _, old in FIELDS}


def test_the_old_and_the_present_name_at_once_are_refused():
    for text in ("rig:\n  slide: 1\n  max_slip: 3\n", "grid:\n  rig.max_slip: [3]\n  rig.slide: [1, 2]\n"):
        with pytest.warns(OldNameWarning), pytest.raises(InputError, match=r"x:\d: (rig\.)?slide is the old name"):
            parse_document(text, "x")


@pytest.mark.parametrize("old", ["rig.slide", "slide"])
def test_the_schema_explains_an_old_field_by_its_present_name(old, recwarn):
    lines = field_lines(old)
    assert lines[:2] == [f"{old} is now called rig.max_slip", "rig.max_slip"]
    assert lines[1:] == field_lines("rig.max_slip") and not recwarn.list
    assert field_lines("draw_in")[0] == "draw_in is now called fabric.knitting.loop_shortening"
    with pytest.raises(InputError, match="differ: is now called differing_fields, a field of the file of a study"):
        field_lines("differ")


def test_files_that_no_run_reads_give_no_warning(tmp_path, monkeypatch, recwarn):
    (tmp_path / "configs").mkdir()
    (tmp_path / "configs" / "stale.yaml").write_text("name: stale\nknitting: {draw_in: 1}\n")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match=r"unknown fabric .*stale"):
        resolve(variant="none")
    assert not recwarn.list


def test_names_of_files_stay(recwarn):
    text = "curve: shorter.csv\nfabric: rig.turns.csv\nfabrics: [differ.yaml, rig.turns.yaml]\nref: a. rig.torn\n"
    assert list(parse_document(text, "x").data.values()) == [
        "shorter.csv", "rig.turns.csv", ["differ.yaml", "rig.turns.yaml"], "a. rig.torn",
    ]  # fmt: skip
    assert not recwarn.list


def test_mappings_given_as_values_have_present_names_too():
    with pytest.warns(OldNameWarning):
        assert parse_set("solver={max_drag: 3}").value == {"max_damping_force": 3}
        assert parse_set("rig.holder={drag: 3}").value == {"damping_rate": 3}
        grid = parse_document("grid: {fabric.knitting: [{draw_in: 1}]}", "x").data["grid"]
    assert grid == {"fabric.knitting": [{"loop_shortening": 1}]}


def test_a_field_that_another_package_calls_so_keeps_its_name(monkeypatch, recwarn):
    class Own(BaseModel):
        turns: int

    class OwnRun(BaseModel):
        rig: Own

    monkeypatch.setattr("knittest.config.run.RUNS", {**RUNS, "own": OwnRun})
    assert parse_set("rig.turns=2").path == ("rig", "turns") and not recwarn.list
