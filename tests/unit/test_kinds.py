"""Records of the tests: everything of a test stands there, and no literal elsewhere in the package lists the tests."""

import ast
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest
from click.testing import CliRunner
from pydantic import Field

from knittest.base import kinds as module
from knittest.base.errors import InputError
from knittest.base.kinds import JoinedParts, Parts, kinds, test_names
from knittest.cli.main import cli
from knittest.config.base import Strict
from knittest.config.run import Run, rig_model
from knittest.experiment.origin import Origin
from knittest.export.lock import results_of_runs, tables_of_runs
from knittest.laboratory.base import Test
from knittest.laboratory.report_base import REPORTS, TESTS, _make_part
from knittest.solve.simulation import simulate
from knittest.solve.state import SILENT

PACKAGE = Path(module.__file__).parents[1]
#: lists of tests that are the subject of their file, with the reason
ALLOWED = {
    "studies/homogenise/plan.py": "homogenising is pulling, shearing and bending, whatever other tests there are",
}


#: files outside the folder of a test that name it, with the reason
NAMED = {
    "base/kinds.py": "the test that a command means unless it names one",
    "cli/system.py": "its subject is a given model of yarns, of which the largest is a frame",
    "cli/export.py": "its subject are the tools of forming",
    "experiment/lab_conditions.py": "quantities of files and tables, each within the bounds of a field of a rig",
    "laboratory/base.py": "curves of tension are measured by tensile tests, and say so",
    "export/line_picture.py": "friction is an energy here",
    "export/identity.py": "the cell is the relaxed one that yarns are cut from",
    "cli/fabric.py": "the cell is the relaxed one that yarns are cut from",
    **dict.fromkeys(
        (f"laboratory/cell/{name}.py" for name in ("config", "path", "report", "test")),
        "biaxial and compaction are paths of a cell too",
    ),
    **dict.fromkeys(
        ("cli/studies.py", "studies/homogenise/command.py"), "a card may come from paths of a cell instead of tests"
    ),
    "solve/body.py": "friction is a coefficient here",
    "solve/relaxed_cell.py": "the fabric of soft yarns relaxes as a cell",
    **dict.fromkeys(
        ("config/fabric.py", "config/sources.py", "config/suspicious_values.py", "laboratory/reference_curves.py"),
        "biaxial is also the macro law of two strains",
    ),
    **dict.fromkeys(
        ("studies/homogenise/card.py", "studies/homogenise/check.py", "studies/homogenise/plan.py",
         "studies/homogenise/derived_card.py"),
        "homogenising is pulling, shearing and bending, whatever other tests there are",
    ),
}  # fmt: skip


def names_of_tests(source: str, known: set[str]) -> set[str]:
    """Names of tests that stand as texts in ``source``."""
    texts = {node.value for node in ast.walk(ast.parse(source)) if isinstance(node, ast.Constant)}
    return known & {text for text in texts if isinstance(text, str)}


def test_a_test_is_named_in_its_folder_only():
    """A branch on one test, or what it is asked for, stands in its folder or its record."""
    found = {}
    for path in PACKAGE.rglob("*.py"):
        name = path.relative_to(PACKAGE).as_posix()
        own = path.parent.name.replace("_", "-") if path.parts[-3] == "laboratory" else ""
        if others := names_of_tests(path.read_text(encoding="utf-8"), set(kinds())) - {own}:
            found[name] = others
    assert found.pop("laboratory/friction/lab_files.py") == {"forming"}  # tools of forming rub as plates do
    assert set(found) == set(NAMED)


def lists_of_tests(source: str, known: set[str]) -> list[int]:
    """Lines of literals (tuple, list, set, dict, subscript, match) with three or more names of tests."""
    found = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Tuple | ast.List | ast.Set | ast.Dict | ast.Match):
            texts = {one.value for one in ast.walk(node) if isinstance(one, ast.Constant)}
            if len(known & {text for text in texts if isinstance(text, str)}) >= 3:
                found.append(node.lineno)
    return found


def test_no_literal_outside_the_laboratory_lists_tests():
    known = set(kinds())
    assert len(known) >= 5
    found = {}
    for path in PACKAGE.rglob("*.py"):
        name = path.relative_to(PACKAGE).as_posix()
        if lines := lists_of_tests(path.read_text(encoding="utf-8"), known):
            found[name] = lines
    assert set(found) == set(ALLOWED)


@pytest.mark.parametrize("name", test_names())
def test_a_record_names_what_is_there(name):
    kind = kinds()[name]
    rig = kind.load("run").model_fields["rig"].annotation
    assert rig.model_fields["kind"].default == name
    assert isinstance(TESTS[name].ends_at_failure, bool) and REPORTS[name].axes.x
    for part in ("presets", "laboratory", "advice", "size", "sheet"):
        assert not getattr(kind, part) or kind.load(part)
    assert set(kind.published) <= set(kind.labels) | set(kind.other_names)
    assert set(kind.sized) | set(kind.diagnostic) <= set(kind.labels)
    assert set(kind.regression.buckled) | set(kind.regression.crests) <= set(kind.labels)
    fields_named = {*kind.sizes, *kind.hinges, *kind.measured, *kind.tied, *kind.tied.values()}
    assert fields_named <= set(rig.model_fields)


def test_files_of_all_tests_are_those_of_runs():
    for kind in kinds().values():
        assert set(kind.pictures) <= set(results_of_runs()) and set(kind.tables) <= set(tables_of_runs())
    assert "yarn-forces.csv" in tables_of_runs() and "pressure.png" in results_of_runs()


def test_two_labels_for_one_result_are_refused(monkeypatch):
    one = kinds()["tensile"]
    other = replace(one, name="other", labels={"peak_force_n": ("force", "{:.0f}")})
    monkeypatch.setattr(module, "kinds", lambda: {"tensile": one, "other": other})
    with pytest.raises(InputError, match="test other: labels: peak_force_n is"):
        len(JoinedParts("labels"))


def test_a_part_is_made_once_and_only_where_it_is_asked_for():
    made = []
    parts = Parts(lambda kind: made.append(kind.name) or kind.name)
    assert parts["friction"] == parts["friction"] == "friction" and made == ["friction"]
    assert "nothing" not in parts and list(parts) == test_names()
    with pytest.raises(KeyError):
        parts["nothing"]


def test_a_record_that_names_nothing_is_refused():
    with pytest.raises(InputError, match="test friction: report cannot be loaded"):
        replace(kinds()["friction"], report="knittest.laboratory.friction.nowhere:Report").load("report")
    with pytest.raises(InputError, match="expected module:name"):
        replace(kinds()["friction"], report="Report").load("report")


def test_a_run_of_a_rig_that_is_none_is_no_class():
    class Bench(Strict):
        kind: str = "bench"

    with pytest.raises(TypeError, match=r"BenchRun\.rig: expected a knittest\.config\.rigs\.Rig"):

        class BenchRun(Run):
            rig: Bench = Field(default_factory=Bench)


@pytest.mark.parametrize("name", test_names())
def test_config_and_files_of_a_test_stand_in_its_folder(name):
    kind, folder = kinds()[name], f"knittest.laboratory.{name.replace('-', '_')}."
    parts = (kind.run, kind.test, kind.report, kind.size, kind.sheet, kind.presets, kind.advice, kind.laboratory)
    named = [one for one in (*parts, kind.origin, kind.lasting, kind.corrections, kind.study) if isinstance(one, str)]
    assert all(part.startswith(folder) for part in named if part)
    rig = rig_model(name)
    assert (rig.spans or "macro" not in kind.scales) and set(rig.spans) <= set(rig.model_fields)


class Unfinished(Test):
    """A test that inherits what it does not have."""

    ends_at_failure = False

    def prepare(self, run, specimen=0, observer=SILENT): ...


def test_a_part_that_cannot_be_made_is_refused():
    kind = replace(kinds()["friction"], test=f"{__name__}:Unfinished")
    with pytest.raises(
        InputError, match=rf"test friction: {__name__}:Unfinished lacks assess, results, solve: see Test"
    ):
        _make_part(kind, "test", Test)


class Earlier(Unfinished):
    """A test with the check of an earlier version, which nothing calls any more."""

    solve = results = assess = refuse = Unfinished.prepare


def test_a_test_with_an_old_check_is_told_its_present_name():
    kind = replace(kinds()["friction"], test=f"{__name__}:Earlier")
    with pytest.raises(InputError, match=rf"{__name__}:Earlier: refuse is now called check_run: rename"):
        _make_part(kind, "test", Test)


def test_old_methods_of_an_origin_and_a_rig_are_told_their_present_names():
    with pytest.raises(InputError, match="fed is now called input_row_kind: rename"):
        type("Own", (Origin,), {"fed": lambda self, run: "input"})
    rig = type("Own", (), {"finished": lambda self, force, peak, broken: True})()
    with pytest.raises(InputError, match="Own: finished is now called is_finished"):
        simulate(SimpleNamespace(critical_step=1.0), rig, SimpleNamespace(safety=1.0), None)


def test_an_option_of_a_test_keeps_all_digits(monkeypatch):
    asked = {}
    monkeypatch.setattr("knittest.cli.options.resolve_runs", lambda kind, direction, chosen: asked.update(chosen) or [])
    monkeypatch.setattr("knittest.studies.command.run_command", lambda runs, options: 0)
    CliRunner().invoke(cli, ["forming", "--variant", "1", "--blank-holder-force", "1234.567"])
    assert "rig.blank_holder_force=1234.567" in asked["sets"]


def test_a_checkout_has_the_tests_that_it_states_now_however_old_its_installation(monkeypatch):
    monkeypatch.setattr(module, "entry_points", lambda group: [])
    assert list(kinds.__wrapped__()) == [name for name in test_names() if kinds()[name].run.startswith("knittest.")]
    monkeypatch.setattr(module, "_checkout_entries", lambda path: [])
    with pytest.raises(
        InputError,
        match=r"tests of knittest are not installed \(knittest\.laboratory\.bias_extension\.kind, .*pip "
        "install",
    ):
        kinds.__wrapped__()


def test_a_project_beside_the_package_that_is_another_states_nothing(tmp_path):
    path = tmp_path / "pyproject.toml"
    path.write_text('[project]\nname = "other"\n[project.entry-points."knittest.tests"]\nwire = "wire.kind:KIND"\n')
    assert module._checkout_entries(path) == [] and module._checkout_entries(tmp_path / "none.toml") == []
    path.write_text(path.read_text().replace("other", "knittest"))
    assert [(entry.name, entry.value) for entry in module._checkout_entries(path)] == [("wire", "wire.kind:KIND")]
