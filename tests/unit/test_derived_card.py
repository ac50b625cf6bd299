"""A fabric without a material card of its shells gets one from a cell of its yarns, once."""

import hashlib
import json

import homogenise_cases
import numpy as np
import pytest
import yaml
from homogenise_cases import BENDING, STRAIN, YARN_FORCE, Formulas, pull, shear

from knittest.base.errors import InputError, NumericalError
from knittest.cli.main import run as knittest
from knittest.config.base import Quantity
from knittest.config.loading import resolve
from knittest.config.settings import leaf_values
from knittest.config.suspicious_values import find_suspicious_values
from knittest.config.yaml_writer import dump
from knittest.laboratory.base import biaxial_table, fabric_laminate, tension_curves
from knittest.materials.biaxial import contraction_of
from knittest.materials.laminate import fit_table, scale_membrane
from knittest.studies.homogenise import card, derived_card
from knittest.studies.homogenise.derived_card import complete_cards, missing_parts, paths_to_run
from knittest.studies.homogenise.plan import PLANNED_TESTS


@pytest.fixture
def pool(tmp_path, monkeypatch):
    """A new fabric in an empty cache, whose paths are formulas; the pools that were made."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(derived_card, "cache_folder", lambda *names: tmp_path)
    made: list[Formulas] = []

    def local(workers, threads):
        made.append(Formulas())
        return made[-1]

    monkeypatch.setattr(derived_card, "LocalPool", local)
    assert knittest(["new", "mine"]) == 0
    path = tmp_path / "configs" / "mine.yaml"  # of which the formulas are torn within the path
    path.write_text(
        path.read_text().replace("fracture_strain: {value: 1.0, sd: 0.15,", "fracture_strain: {value: 1.5,")
    )
    return made


def shells(*sets: str, test: str = "tensile", **asked):
    return resolve(variant="mine", scale="macro", preset="quick", test=test, sets=sets, **asked)


def test_a_new_fabric_has_no_card_and_its_shells_get_that_of_its_yarns(pool):
    run = shells(direction="warp")
    assert run.fabric.macro.missing_card_parts == missing_parts(run) == ("tension", "bending_stiffness", "shear")
    assert [cell.rig.path for cell in paths_to_run(run)] == ["warp", "weft", "bending", "bending", "shear"]
    (done,) = complete_cards([run], quiet=True)
    macro = done.fabric.macro
    for direction, strain in STRAIN.items():
        density = run.fabric.density_per_mm.of(direction)
        curve = tension_curves(done.fabric)[direction]
        assert curve.mean.max() == pytest.approx(density * YARN_FORCE, rel=1e-3)
        assert macro.fracture_strain.of(direction).value == pytest.approx(strain, rel=1e-3)
        assert macro.bending_stiffness.of(direction).value == BENDING[direction]
        assert macro.tension[direction].source == macro.fracture_strain.of(direction).source == "derived"
    assert macro.shear.source == macro.bending_stiffness.warp.source == "derived"
    angle, force = np.array(macro.shear.points).T
    assert force == pytest.approx(shear(angle), rel=0.05, abs=1e-4)
    fabric_laminate(done)


def test_yarns_of_scattered_strength_make_a_weaker_card(pool):
    """A bundle whose strength scatters by 15 % breaks at some 0.73 of the mean strength (Daniels, 1945)."""
    run = shells("fabric.reinforcing.fracture_strain={value: 1.5, sd: 0.225, source: user}", direction="warp")
    (done,) = complete_cards([run], quiet=True)
    macro, last = done.fabric.macro, STRAIN["warp"]
    peak = max(force for _, force in macro.tension["warp"].points)
    assert 0.75 * last < macro.fracture_strain.warp.value < 0.95 * last
    strong = run.fabric.warp_density_per_mm * YARN_FORCE
    left = peak / (run.fabric.warp_density_per_mm * pull(macro.fracture_strain.warp.value, last))
    assert 0.5 * strong < peak < 0.8 * strong and 0.75 < left < 1.0  # of the yarns that are not torn


def test_a_card_is_derived_once_and_the_resolved_config_keeps_it(pool, tmp_path):
    first, second = complete_cards([shells(direction="warp"), shells(direction="weft")], quiet=True)
    assert len(pool) == 1 and first.fabric == second.fabric
    assert complete_cards([shells(direction="warp")], quiet=True) == [first] and len(pool) == 1
    assert paths_to_run(shells()) == []
    (tmp_path / "run.yaml").write_text(dump(first))
    again = resolve(config=tmp_path / "run.yaml")
    assert again == first and missing_parts(again) == ()
    changed = resolve(config=tmp_path / "run.yaml", sets=["fabric.knitting.youngs_modulus=50"])
    assert missing_parts(changed) == ("tension", "bending_stiffness", "shear")
    stated = resolve(config=tmp_path / "run.yaml", sets=["fabric.macro.bending_stiffness.warp=9"])
    assert complete_cards([stated]) == [stated]


def test_a_card_of_yarns_with_an_old_field_name_is_kept(pool, tmp_path):
    (run,) = complete_cards([shells("fabric.knitting.loop_shortening=1", direction="warp")], quiet=True)
    numbers = [(name.replace("loop_shortening", "draw_in"), str(value)) for name, value in
               leaf_values(derived_card._yarn_fields(run.fabric))]  # fmt: skip
    old = hashlib.sha256(json.dumps(sorted(numbers)).encode()).hexdigest()[: derived_card.DIGITS]
    (tmp_path / "run.yaml").write_text(dump(run).replace(derived_card._digest(run.fabric), old))
    again = resolve(config=tmp_path / "run.yaml")
    assert again != run and missing_parts(again) == ()
    changed = resolve(config=tmp_path / "run.yaml", sets=["fabric.knitting.loop_shortening=2"])
    assert missing_parts(changed) == ("tension", "bending_stiffness", "shear")


def test_what_is_stated_of_a_card_stays(pool):
    law = "fabric.macro.shear={kind: linear, stiffness: 0.02}"
    run = shells(law, direction="warp")
    (done,) = complete_cards([run], quiet=True)
    assert done.fabric.macro.shear == run.fabric.macro.shear
    assert len(pool[0].asked) == 4 and not any("picture-frame" in name for name in pool[0].asked)


def test_a_path_is_tried_again_and_its_rejected_law_decides_no_test(pool, monkeypatch, capsys):
    asked: list[Formulas] = []
    tried = []

    def ends(trial) -> str:
        if trial.run.rig.path == "shear":
            tried.append(trial.run)
        return "refused" if trial.run.rig.path == "shear" else "completed"

    def local(workers, threads):
        asked.append(Formulas(ends))
        return asked[-1]

    monkeypatch.setattr(derived_card, "LocalPool", local)
    monkeypatch.setattr(
        derived_card, "_read_result", lambda piece, tested: derived_card.PathResult(*np.array([[0.0, 2.0], [0.0, 0.3]]))
    )
    (strip,) = complete_cards([shells(direction="warp")], quiet=True)
    assert [len(pool.asked) for pool in asked] == [5, 1, 1, 1]
    assert [run.model.meso.elements_per_loop for run in tried] == [30, 30, 42, 42]
    assert [run.solver.speed / tried[0].solver.speed for run in tried] == [1.0, 0.5, 1.0, 0.5]
    assert [run.solver.safety for run in tried] == [0.9, 0.6, 0.9, 0.6]
    assert "failed its quality checks: refused on purpose" in strip.fabric.macro.shear.ref
    with pytest.raises(
        NumericalError, match=r"macro\.shear cannot be derived from the yarns\. The pic.* refused on purpose\. Add"
    ):
        complete_cards([shells(test="picture-frame")], quiet=True)
    assert len(asked) == 4  # the cache knows it
    (note,) = find_suspicious_values(strip)
    assert "macro.shear is not reliable" in note and "do not depend on it" in note
    thin = strip.fabric.model_copy(update={"loop_length": Quantity(value=30.0, source="user")})
    text = derived_card._failure_text(thin, PLANNED_TESTS[2], "failed")
    assert "1.7 % of loop_length thick" in text and "Use a thicker knitting yarn" in text


def test_a_path_that_tears_no_yarn_goes_farther(pool, monkeypatch, tmp_path):
    """Inlays that wave more than their crimp are torn later: the path grows until they are, to 50 % at most."""
    path = tmp_path / "configs" / "mine.yaml"
    path.write_text(path.read_text().replace("fracture_strain: {value: 1.5,", "fracture_strain: {value: 0.7,"))
    ends = []

    def note(trial) -> str:
        if trial.run.rig.path == "warp":
            ends.append(trial.run.rig.max_strain)
        return "completed"

    monkeypatch.setattr(derived_card, "LocalPool", lambda workers, threads: Formulas(note))
    complete_cards([shells(direction="warp")], quiet=True)
    assert len(ends) > 1 and ends[-1] >= STRAIN["warp"] > ends[-2]
    assert ends == pytest.approx([ends[0] * 1.6**k for k in range(len(ends))])


def test_a_path_that_fails_says_what_to_give(pool, monkeypatch):
    monkeypatch.setattr(derived_card, "LocalPool", lambda workers, threads: Formulas(lambda trial: "failed"))
    with pytest.raises(
        NumericalError, match=r"tensile warp path of a cell failed: failed on purpose\. Add macro\.tension"
    ):
        complete_cards([shells(direction="warp")], quiet=True)


def test_check_says_that_a_card_is_derived_first(pool, capsys):
    assert knittest(["check", "tensile", "--variant", "mine", "--scale", "macro", "--no-time"]) == 0
    assert "first derives it from 5 simulations of a meso cell" in capsys.readouterr().out
    assert not pool
    complete_cards([shells()], quiet=True)
    assert knittest(["check", "tensile", "--variant", "mine", "--scale", "macro", "--no-time"]) == 0
    assert "first derives it" not in capsys.readouterr().out


def test_a_fabric_that_states_neither_card_nor_yarns_is_rejected_for_shells(pool, tmp_path):
    path = tmp_path / "configs" / "mine.yaml"
    data = yaml.safe_load(path.read_text())
    path.write_text(yaml.safe_dump(data | dict.fromkeys(("loop_length", "reinforcing", "knitting", "contact"))))
    with pytest.raises(
        InputError, match=r"the macro scale needs macro\.tension, macro\.bending_stiffness, macro\.shea"
    ):
        shells()


def test_shells_of_a_fabric_without_a_card_break_with_its_yarns(pool, tmp_path, capsys):
    arguments = ["--direction", "warp", "--scale", "macro", "--preset", "quick", "--no-frames", "--no-pictures"]
    assert knittest(["tensile", "--variant", "mine", *arguments, "--out", "r", "--json"]) == 0
    peak = yaml.safe_load(capsys.readouterr().out)["results"]["peak_force_n"]
    assert peak == pytest.approx(50.0 * 0.28 * YARN_FORCE, rel=0.01)


def knit_forces(strain):
    """Forces (n, 2) of loops that lock along warp + 0.5 weft, and hardly resist else; a gradient of an energy."""
    locking = 2.0 * np.maximum(strain @ [1.0, 0.5], 0.0) ** 2
    return 0.02 * strain + locking[:, None] * [1.0, 0.5]


@pytest.fixture
def knit(pool, monkeypatch):
    """Jersey without a card, whose paths are :func:`knit_forces`."""
    monkeypatch.setattr(homogenise_cases, "coupled", knit_forces)
    assert knittest(["new", "soft", "--structure", "jersey"]) == 0
    return pool


def test_loops_without_inlays_get_one_law_of_both_strains(knit):
    """From eleven paths; strips contract as the energy says, and nothing fails."""
    run = resolve(variant="soft", scale="macro", preset="quick", test="tensile", direction="warp")
    assert run.pulls_loops and run.rig.max_strain == 40.0
    assert [cell.rig.path for cell in paths_to_run(run)] == ["steps"] * 11 + ["bending", "bending", "shear"]
    (done,) = complete_cards([run], quiet=True)
    macro = done.fabric.macro
    assert macro.tension is None and macro.fracture_strain is None and macro.missing_card_parts == ()
    assert macro.biaxial.source == "derived" and macro.biaxial.curve is None and missing_parts(done) == ()
    table = biaxial_table(done.fabric)
    strain, force = table.samples
    assert force == pytest.approx(knit_forces(strain), abs=0.02 * force.max())
    fit = fit_table(done.fabric, table)
    pull = np.linspace(0.05, 0.3, 6)
    across = contraction_of(fit.law, 0, pull)
    other = knit_forces(np.column_stack([pull, across]))[:, 1]
    assert np.abs(other).max() < 0.01 * knit_forces(np.column_stack([pull, across]))[:, 0].max() and across[-1] < -0.2
    again = complete_cards([resolve(variant="soft", scale="macro", preset="quick", test="biaxial")], quiet=True)
    assert len(knit) == 1 and again[0].fabric.macro.biaxial == macro.biaxial  # from the cache


def test_slack_loops_bend_with_the_least_stiffness_of_a_card(knit, monkeypatch):
    """Marked as assumed; a strip of such shells hangs by that stiffness, whatever its slack loops resist."""
    monkeypatch.setitem(homogenise_cases.BENDING, "warp", 0.0)
    (done,) = complete_cards([resolve(variant="soft", scale="macro", preset="quick", test="cantilever")], quiet=True)
    bending = done.fabric.macro.bending_stiffness
    assert (bending.warp.value, bending.warp.source) == (card.LEAST_BENDING, "assumed")
    assert "slack loops bend with less" in bending.warp.ref and bending.weft.source == "derived"
    sheet = fabric_laminate(done)
    flat = scale_membrane(sheet, 0.01)
    assert (flat.slope[:, 0] + 2.0 * flat.outer >= 2.0 * flat.outer * 1.19).all()


def test_a_sheared_cell_of_loops_ends_earlier_where_it_fails(knit, monkeypatch):
    """Soft shells are sheared beyond 42.5 deg, the end of other cells."""
    ends = []

    def fail_first(trial) -> str:
        if trial.run.rig.path != "shear":
            return "completed"
        ends.append(trial.run.rig.max_angle)
        return "failed" if len(ends) == 1 else "completed"

    monkeypatch.setattr(derived_card, "LocalPool", lambda workers, threads: Formulas(fail_first))
    run = resolve(variant="soft", scale="macro", preset="quick", test="picture-frame")
    (done,) = complete_cards([run], quiet=True)
    assert ends == [60.0, 42.5] and done.rig.max_angle < 42.5


@pytest.mark.parametrize(("glass", "carbon", "weaker"), [(0.3, 0.0, False), (0.0, 0.1, True)])
def test_the_layer_that_fails_first_scatters_the_strength(glass, carbon, weaker):
    """Carbon of 0.975 % fails first and carries 98 % of the force; glass of 2.6 % is far from its strength."""
    fibres = (("E-glass", 50, 2.6, glass), ("carbon HT", 800, 0.975, carbon))
    yarns = [
        f"{{fibre: {fibre}, linear_density: {tex}, fracture_strain: {{value: {strain}, sd: {sd}, source: assumed}}}}"
        for fibre, tex, strain, sd in fibres
    ]
    layers = ", ".join(f"{{direction: warp, yarn: {yarn}}}" for yarn in yarns)
    layers = f"fabric.layers=[{layers}, {{direction: weft}}]"
    fabric = resolve(variant="two-yarns", test="tensile", scale="meso", direction="warp", sets=[layers]).fabric
    strain = np.linspace(0.0, 100.0 * fabric.straight_failure_strain("warp"), 100)
    _, held = derived_card._scattered_tension(fabric, "warp", strain, 30.0 * strain)
    share = held.max() / (30.0 * strain[-1])
    assert share == pytest.approx(1.0, abs=1e-9) if not weaker else 0.8 < share < 0.92
