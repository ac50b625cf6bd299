"""The tests as functions: what callers may give, what is refused and with which words, what a folder is read as."""

import ast
import inspect
import json
import subprocess
import sys
from importlib.metadata import entry_points
from pathlib import Path

import numpy as np
import pytest

import knittest
from knittest.api import tests
from knittest.base.kinds import kinds
from knittest.config.aliases import OldNameWarning
from knittest.errors import InputError


@pytest.fixture
def handed(monkeypatch):
    """Runs and options that would have been executed."""
    found = {}

    class Stop(Exception):
        pass

    def record(runs, options):
        found.update(runs=runs, options=options)
        raise Stop

    monkeypatch.setattr("knittest.studies.command.run_all", record)

    def call(name, *args, **given):
        with pytest.raises(Stop):
            getattr(knittest, name)(*args, **given)
        return found["runs"], found["options"]

    return call


def test_import_loads_nothing_heavy():
    code = "import knittest, sys; print([m for m in "
    code += "('numba','numpy','matplotlib','pandas','pydantic') if m in sys.modules])"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout == "[]\n"


def test_every_test_is_a_function_with_units_and_every_name_is_there():
    functions = [getattr(knittest, name.replace("-", "_")) for name in kinds()]
    assert len(functions) >= 10 and all("[" in function.__doc__ for function in functions)
    assert "[N]" in knittest.tensile.__doc__ and "tensile" in dir(knittest)
    assert all(getattr(knittest, name) is not None for name in knittest.__all__)
    assert (Path(knittest.__file__).parent / "py.typed").is_file()
    with pytest.raises(AttributeError, match='did you mean "tensile"'):
        knittest.tensil  # noqa: B018


def test_help_and_editors_see_every_argument_of_a_test():
    """The signature is that of what the function takes: common options, then its own; strips alone have a direction."""
    for name, kind in kinds().items():
        given = inspect.signature(getattr(knittest, name.replace("-", "_"))).parameters
        assert ("direction" in given) == kind.directional
        assert set(given) - {"fabric", *tests.Options.__annotations__} == set(kind.own_fields)
    force = inspect.signature(knittest.forming).parameters["blank_holder_force"]
    assert (force.annotation, force.default) == (float | None, None)
    assert inspect.signature(knittest.tensile).parameters["frames"].default is True


def test_the_stub_has_the_names_of_the_package():
    tree = ast.parse((Path(knittest.__file__).parent / "__init__.pyi").read_text())
    imported = {one.asname for node in tree.body if isinstance(node, ast.ImportFrom) for one in node.names}
    defined = {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}
    assert imported | {"__version__"} == set(knittest.__all__)
    shipped = {one.name for one in entry_points(group="knittest.tests") if one.value.startswith("knittest.")}
    assert defined == {name.replace("-", "_") for name in shipped}


@pytest.mark.parametrize("fabric", [2, "2", "pham2019-v2"])
def test_a_number_or_a_name_is_a_shipped_fabric(handed, fabric):
    runs, _ = handed("tensile", fabric, scale="macro", preset="quick")
    assert [(run.fabric.name, run.direction) for run in runs] == [("pham2019-v2", "warp"), ("pham2019-v2", "weft")]


def test_values_reach_the_fields_of_the_run(handed):
    sets = {"rig.width": np.float64(40), "rig": {"gauge_length": 180}}
    (run,), options = handed(
        "tensile", "1", direction="weft", set=sets, out="x", frames=False, against="c.csv", threads=2
    )
    assert (run.rig.width_mm, run.rig.gauge_length_mm, run.direction) == (40.0, 180.0, "weft")
    assert (options.out, options.frames, options.pictures, options.against, options.threads) == (
        Path("x"), False, True, (Path("c.csv"),), 2)  # fmt: skip
    (run,), _ = handed("forming", "1", preset="quick", blank_holder_force=30)
    assert run.rig.blank_holder_force == 30


def test_a_fabric_with_other_numbers_is_the_users(handed):
    base = knittest.Fabric.load(1)
    other = base.with_(loop_length=14.2, contact={"friction_coefficient": 0.15}, reinforcing={"crimp": {"warp": 0.5}})
    (run,), _ = handed("tensile", other, direction="warp")
    assert (run.fabric.loop_length.value, run.fabric.loop_length.source) == (14.2, "user")
    assert run.fabric.contact.friction_coefficient.value == 0.15 and run.fabric.reinforcing.crimp.warp.value == 0.5
    (run,), _ = handed("tensile", base, direction="warp")
    assert run.fabric.loop_length.value != 14.2
    with pytest.raises(InputError, match='did you mean "loop_length"'):
        base.with_(lop_length=14.2)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({}, "which fabric"),
        ({"fabric": True}, "expected"),
        ({"fabric": Path("none.yaml")}, "no such fabric file"),
        ({"fabric": 3}, "unknown fabric"),
        ({"fabric": 1, "direction": "wrap"}, 'did you mean "warp"'),
        ({"fabric": 1, "scale": "mseo"}, 'did you mean "meso"'),
        ({"fabric": 1, "threads": 0}, "whole number"),
        ({"fabric": 1, "set": {"rig.widht": 3}}, 'did you mean "width"'),
        ({"fabric": 1, "set": 3}, "expected a dict"),
    ],
)
def test_a_bad_value_is_an_input_error(given, words):
    with pytest.raises(InputError, match=words):
        knittest.tensile(**given)


def test_an_argument_there_is_not_names_the_nearest_or_the_field():
    with pytest.raises(TypeError, match=r'tensile\(\) got an unexpected argument \'presett\' \(did you mean "preset"'):
        knittest.tensile(1, presett="quick")
    with pytest.raises(TypeError, match=r'set=\{"rig.width"'):
        knittest.tensile(1, width=40)
    with pytest.raises(TypeError, match="direction"):
        knittest.forming(1, direction="warp")


def test_a_stopped_run_has_no_results_and_says_how_to_go_on(tmp_path):
    (tmp_path / "manifest.json").write_text(json.dumps({"status": "interrupted"}))
    run = knittest.load(str(tmp_path))
    assert run.status == "interrupted" and "interrupted" in repr(run)
    for name in ("results", "curve", "quality_checks", "energies"):
        with pytest.raises(InputError, match=r"knittest\.resume"):
            getattr(run, name)
    with pytest.raises(InputError, match="not a run folder"):
        knittest.load(tmp_path / "none")


def test_a_run_of_both_directions_passes_only_if_both_do(tmp_path):
    for name, refused in (("warp", []), ("weft", ["energy"])):
        folder = tmp_path / name
        folder.mkdir()
        (tmp_path / f"config-{name}.yaml").write_text("")
        (folder / "manifest.json").write_text(json.dumps({"status": "completed"}))
        summary = {"results": {"a_n": 1.0}, "quality": {"q": 0.1}, "refused": refused, "warnings": []}
        (folder / "summary.json").write_text(json.dumps(summary))
        (folder / "curve.csv").write_text("time_ms,force_n\n0,1\n1,2\n")
    runs = knittest.load(tmp_path)
    checks = runs.quality_checks
    assert runs.warp.quality_checks and not runs.weft.quality_checks and not checks
    assert checks.refused == ["weft: energy"]
    for one in (runs, runs.warp):
        with pytest.warns(OldNameWarning, match="gates is now called quality_checks"):
            assert one.gates == one.quality_checks
    assert list(runs.curve.columns) == ["direction", "time_ms", "force_n"] and len(runs.curve) == 4
    assert list(runs.curve.index) == [0, 1, 2, 3] and runs["weft"].results == {"a_n": 1.0}
    with pytest.warns(knittest.errors.RefusedWarning, match="weft: energy"):
        tests._warn_if_rejected(runs)


@pytest.mark.parametrize("notebook", [True, False])
def test_show_is_the_moving_view(tmp_path, monkeypatch, notebook):
    """Of one run and of several: in a notebook the pages whole, else each in the browser."""
    from knittest.api import notebook_view, run
    from knittest.report_page.moving import page

    def view(folder):
        (folder / "view.html").write_text(f'<p class="a">{folder.name} & more</p>')
        return folder / "view.html"

    monkeypatch.setattr(page, "write_view", view)
    monkeypatch.setattr(notebook_view, "is_in_notebook", lambda: notebook)
    opened: list[str] = []
    monkeypatch.setattr("webbrowser.open", opened.append)
    for name in ("warp", "weft"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "manifest.json").write_text('{"status": "completed"}')
    runs = run.Runs(tmp_path, [run.Run(tmp_path / name) for name in ("warp", "weft")])
    for shows, names in ((runs.warp, ["warp"]), (runs, ["warp", "weft"])):
        found = shows.show()
        if notebook:
            html = found._repr_html_()
            for name in names:
                assert f'srcdoc="&lt;p class=&quot;a&quot;&gt;{name} &amp; more&lt;/p&gt;"' in html
            assert html.count("<iframe") == len(names) and not opened
        else:
            assert found is None and opened == [(tmp_path / name / "view.html").as_uri() for name in names]
            opened.clear()
