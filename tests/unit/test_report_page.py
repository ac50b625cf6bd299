"""Pages of single runs: whole in themselves, with the numbers of the run folder, and nothing of a user's as markup."""

import base64
import io
import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from html_page import HtmlPage, near
from matplotlib.image import imsave
from PIL import Image
from report_sample import METRICS, RESULTS, RIGS, curves, edit_json, write_run

from knittest.base.errors import InputError
from knittest.config.yaml_loader import load_yaml
from knittest.laboratory.report_base import REPORTS
from knittest.report_page.page import write_report, write_reports
from knittest.report_page.pictures import compress_picture

GATES = "Quality checks: a run that fails one is not compared with the experiment"
HOSTILE = "</style><script>alert(1)</script>\"'><img src=x onerror=alert(2)> {{ 7*7 }} $\\frac{$ & ü"


def page_of(folder: Path) -> HtmlPage:
    page = HtmlPage(write_report(folder))
    page.check()
    return page


@pytest.fixture(scope="module")
def tensile(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, HtmlPage]:
    folder = write_run(tmp_path_factory.mktemp("runs") / "strip", scale="meso")
    return folder, page_of(folder)


@pytest.mark.parametrize("kind", RIGS)
def test_every_test_has_a_page_with_its_results_curve_and_gates(tmp_path: Path, kind: str) -> None:
    more = {"peak_time_error_pct": 0.6875} if kind == "tensile" else {}
    page = page_of(write_run(tmp_path / "r", kind, results=more))
    shown = page.numbers(page.section("run-1-results"))
    finite = [value for value in RESULTS[kind].values() if value == value]
    assert finite and all(near(value, shown) for value in finite)
    assert page.section("run-1-curve").findall("figure/div/img")
    gates = page.tables(page.section("run-1-gates"))[GATES]
    yarns = {"pull-out": 9, "cell": 8, "compaction": 10}  # with the gate of overlap without force
    assert len(gates) - 1 == ({"tensile": 10, "cantilever": 3, "friction": 11, "forming": 11} | yarns).get(kind, 9)
    assert {row[-1] for row in gates[1:]} == {"pass"}
    assert set(REPORTS) == set(RIGS) and {REPORTS[kind].axes.x, REPORTS[kind].axes.y} <= set(curves(kind))


def test_results_stand_beside_the_experiment_and_energies_are_those_of_the_table(tensile) -> None:
    folder, page = tensile
    tables = page.tables(page.section("run-1-results"))
    rows = {row[0]: row for row in tables["Results, compared with the experiment (Table 3: mean ± sd)"]}
    compared = {row["quantity"]: row for row in json.loads((folder / "summary.json").read_text())["comparison"]}
    peak = compared["peak_force_n"]
    scatter = f"{peak['experiment_mean']:.0f} ± {peak['experiment_sd']:.0f}"
    verdict = f"{peak['deviation_sd']:+.2f} sd within 1 sd"
    assert rows["peak force [N]"][1:5] == ["5666", scatter, verdict, "tuned"]
    metrics = dict(tables[f"Curve compared with {METRICS['compared_with']} (reconstructed)"])
    assert metrics["error of the peak force"] == "-2.625 %"
    assert "Tuned: " in page.text()
    assert "Predicted:" not in page.text(page.section("run-1-results"))
    table = pd.read_csv(folder / "energies.csv")
    columns = [name for name in table if name.endswith("_mj")]
    top = int(pd.read_csv(folder / "curve.csv")["force_n"].argmax())
    energies = page.tables(page.section("run-1-gates"))["Energies [mJ]; not checked after the first failure"]
    assert energies[0] == ["energy", "at the largest force", "at the end"]
    expected = [[f"{table[c].iloc[top]:.4g}", f"{table[c].iloc[-1]:.4g}"] for c in columns]
    assert [row[1:] for row in energies[1:]] == expected


def test_parameters_are_kept_apart_by_where_they_come_from(tensile: tuple[Path, HtmlPage]) -> None:
    folder, page = tensile
    tables = page.tables(page.section("run-1-parameters"))
    fabric = load_yaml(folder / "config.yaml").data["fabric"]
    for source in ("measured", "derived", "tuned", "assumed"):
        (rows,) = [rows for caption, rows in tables.items() if caption.startswith(f"{source.title()}:")]
        assert [row[0].split()[0] for row in rows[1:]] == _paths(fabric, source)
    (tuned,) = [rows for caption, rows in tables.items() if caption.startswith("Tuned")]
    modulus = next(row for row in tuned if row[0].startswith("reinforcing.youngs_modulus"))
    assert modulus[1] == "67.5 ± 17.7 GPa" and modulus[2].endswith("fitted to: V1 warp max. tensile force")
    settings = {row[0] for rows in tables.values() for row in rows}
    assert "model.meso.elements_per_loop" in settings and "model.macro.element_size" not in settings


def _paths(fields: dict, source: str, at: str = "") -> list[str]:
    found = []
    for key, value in fields.items():
        if isinstance(value, dict) and "value" in value:
            found += [at + key] if value["source"] == source else []
        elif isinstance(value, dict):
            found += _paths(value, source, f"{at}{key}.")
    return found


def test_an_old_run_with_a_relaxed_limit_states_that_of_the_preset(tmp_path: Path) -> None:
    folder = write_run(tmp_path / "run", sets=["solver.max_law_extrapolation=8"])
    limit = {"name": "solver.max_beyond_law", "value": 8.0, "preset": 5.0, "unit": "%", "accepted": True}
    edit_json(folder / "summary.json", limits=[limit])
    page = page_of(folder)
    text = page.text(page.section("run-1-gates"))
    assert text.count("8 % (preset 5 %)") == 2 and "limit: solver.max_law_extrapolation = 8 %" in text


def test_chart_says_what_the_curve_beside_it_is(tensile: tuple[Path, HtmlPage], tmp_path: Path) -> None:
    _, page = tensile
    chart = page.pictures()[0].decode()  # matplotlib leaves the text of each label as a comment
    assert (
        "<!-- reconstructed (Table 3 of Pham et al. 2019, variant 1, warp) -->" in chart
        and "<!-- experiment, mean ± sd (Table 3) -->" in chart
    )
    assert "warp: reconstructed" in page.text(page.section("run-1-curve"))
    shells = page_of(write_run(tmp_path / "shells"))
    assert "<!-- input of the model (Table 3 of Pham et al. 2019, variant 1, warp) -->" in shells.pictures()[0].decode()
    assert "the input of the macro model is itself reconstructed" in shells.text(shells.section("run-1-curve"))
    friction = page_of(write_run(tmp_path / "plates", "friction"))
    assert "two faces, kinetic" in friction.pictures()[0].decode()


def test_ensemble_has_corridor_spread_and_the_picture_of_all_specimens(tmp_path: Path) -> None:
    page = page_of(write_run(tmp_path / "r", specimens=3))
    chart = page.pictures()[0].decode()
    assert "<!-- simulated, mean, ± sd -->" in chart and "<!-- simulated, peaks of the specimens -->" in chart
    assert "a mean ends at the earliest peak of its specimens" in page.text(page.section("run-1-curve"))
    assert [c for c in page.tables() if c.startswith("Results, mean ± sd of 3 specimens")]
    assert "6233 ± 567 (n 3)" in page.text(page.section("run-1-results"))
    assert "curve.png" in page.text(page.section("run-1-pictures"))
    assert "curve.png" not in page_of(write_run(tmp_path / "one")).text()


def test_refused_run_says_so_and_names_the_gate_with_its_limit(tmp_path: Path) -> None:
    folder = write_run(tmp_path / "r", failures=("energy error 3.10 % is above 2 %",))
    summary = json.loads((folder / "summary.json").read_text())
    edit_json(folder / "summary.json", quality=summary["quality"] | {"energy_error_max": 0.031, "added_mass_pct": None})
    page = page_of(folder)
    assert "Not compared with the experiment: energy error 3.10 % is above 2 %" in page.text(page.section("summary"))
    gates = page.tables()[GATES]
    assert ["energy error", "3.1 %", "2 %", "FAIL"] in gates
    assert ["added mass", "-", "5 %", "not measured"] in gates
    assert page.text(page.section("run-1-results")).count("refused") == 3


def test_repeating_command_config_and_hashes(tensile: tuple[Path, HtmlPage]) -> None:
    folder, page = tensile
    text = page.text(page.section("run-1-repeat"))
    manifest = json.loads((folder / "manifest.json").read_text())
    assert "knittest tensile --config config.yaml --threads 2" in text
    provenance = dict(page.tables(page.section("run-1-repeat"))["Provenance"])
    assert provenance["config.yaml, SHA-256"] == manifest["config_sha256"]
    assert provenance["curves/tensile-v1-warp.csv, SHA-256"] == manifest["data_sha256"]["curves/tensile-v1-warp.csv"]
    assert provenance["numba"] == manifest["libraries"]["numba"] and provenance["seed"] == "1"
    (whole,) = [pre.text for pre in page.all("pre") if pre.text and "fabric:" in pre.text]
    assert whole == (folder / "config.yaml").read_text()
    assert "was changed after the run" not in text


def test_files_changed_since_the_run_are_told(tmp_path: Path) -> None:
    folder = write_run(tmp_path / "r")
    with (folder / "config.yaml").open("a") as stream:
        stream.write("# edited\n")
    hashes = json.loads((folder / "manifest.json").read_text())["data_sha256"]
    edit_json(folder / "manifest.json", data_sha256=dict.fromkeys(hashes, "0" * 64))
    text = page_of(folder).text()
    assert "config.yaml was changed after the run" in text and "tensile-v1-weft.csv was changed after the run" in text


def test_nothing_of_a_user_becomes_markup(tmp_path: Path) -> None:
    folder = write_run(tmp_path / '"><script>alert(0)<')
    assert page_of(folder)
    text = (folder / "config.yaml").read_text()
    quoted = "'" + HOSTILE.replace("'", "''") + "'"
    for written in ("title: Biaxial weft-knit, CF/PA 6.6 inlays, GF/PA 6.6 loops, variant 1", "ref: Table 2"):
        assert written in text
        text = text.replace(written, f"{written.split(':')[0]}: {quoted}")
    (folder / "config.yaml").write_text(text)
    edit_json(folder / "manifest.json", cpu=HOSTILE, message=HOSTILE, status="failed", libraries={HOSTILE: HOSTILE})
    summary = json.loads((folder / "summary.json").read_text())
    rows = [{**row, "kind": HOSTILE, "source": HOSTILE} for row in summary["comparison"]]
    results = summary["results"] | {HOSTILE: 1.0}
    edit_json(folder / "summary.json", comparison=rows, refused=[HOSTILE], results=results)
    edit_json(folder / "comparison.json", curves=[{**METRICS, "compared_with": HOSTILE, "rating": {HOSTILE: HOSTILE}}])
    (folder / f"{HOSTILE.replace('/', '')[:60]}.png").write_bytes((folder / "deformed.png").read_bytes())
    page = page_of(folder)
    assert page.text().count("<script>alert(1)</script>") >= 8
    assert "{{ 7*7 }}" in page.text()


def test_same_folder_gives_the_same_bytes_in_less_than_a_second(tmp_path: Path) -> None:
    folder = write_run(tmp_path / "r")
    first = write_report(folder).read_bytes()
    start = time.process_time()
    assert write_report(folder).read_bytes() == first
    assert time.process_time() - start < 1.0  # 0.2 s measured: a run can afford to write it


def test_a_users_own_curves_are_judged_and_shown_by_the_picture_of_the_run(tmp_path: Path) -> None:
    folder = write_run(tmp_path / "r")
    angles = {"10": {"simulated": 2.0, "reference": 1.6, "error_pct": 25.0}}
    own = {"judged_against": "mine.csv", "reference_kind": "measured", "comparable": True, "force_n_at_deg": angles}
    edit_json(folder / "comparison.json", curves=[METRICS, own])
    page = page_of(folder)
    assert dict(page.tables()["Curve compared with mine.csv (measured)"])["error of the force at 10 deg"] == "25 %"
    assert "curve.png" in page.text(page.section("run-1-pictures"))
    own |= {"comparable": False, "reason": "the curves have no common range"}
    edit_json(folder / "comparison.json", curves=[METRICS, own])
    assert "mine.csv (measured): not comparable: the curves have no common range" in page_of(folder).text()


@pytest.mark.parametrize("fails", [False, True])
def test_the_curve_beside_a_run_is_read_once_a_page(tmp_path: Path, monkeypatch, fails: bool) -> None:
    """Caption, scale and picture have the same one, or the same reason why it is missing."""
    report, asked = REPORTS["tensile"], []

    def counted(run: object, read: Callable[[Any], object] = report.reference_curve) -> object:
        asked.append(run)
        if fails:
            raise InputError("warp.csv: line 3: no number")
        return read(run)

    monkeypatch.setattr(report, "reference_curve", counted)
    text = HtmlPage(write_report(write_run(tmp_path / "r", "tensile"))).text()
    assert len(asked) == 1 and ("warp.csv: line 3: no number" in text) == fails


def test_table_of_shear_stands_with_its_source(tmp_path: Path) -> None:
    law = "fabric.macro.shear={kind: table, curve: null, points: [[0, 0], [40, 0.2]], source: assumed, ref: a guess}"
    page = page_of(write_run(tmp_path / "r", "picture-frame", sets=(law,)))
    tables = page.tables(page.section("run-1-parameters"))
    (assumed,) = [rows for caption, rows in tables.items() if caption.startswith("Assumed")]
    assert [row[1:] for row in assumed if row[0].startswith("macro.shear ")] == [["2 points", "a guess"]]


def test_warnings_stand_on_the_page_of_a_run_and_in_the_overview_of_several(tmp_path: Path) -> None:
    one, two = write_run(tmp_path / "one", "forming"), write_run(tmp_path / "two", "forming")
    edit_json(tmp_path / "one" / "summary.json", warnings=["damping took 15 % of the work"])
    page = HtmlPage(write_reports([one], tmp_path / "one.html")[0])
    assert "Warning: damping took 15 % of the work" in page.text(page.section("summary"))
    both = HtmlPage(write_reports([one, two], tmp_path / "both.html")[0])
    assert "completed, 1 warning" in both.text(both.section("overview"))


def test_pictures_of_yarns_and_of_lines_are_light_and_keep_their_colours(tmp_path: Path) -> None:
    """Shaded noise in a tenth of its bytes, by a few levels off; plain faces without loss; none wider than a page."""
    rng = np.random.default_rng(5)
    shades = 0.5 + 0.25 * np.kron(rng.random((120, 200)), np.ones((10, 10))) + 0.02 * rng.random((1200, 2000))
    plain = np.ones((300, 400, 3))
    plain[100:200, 50:60] = [0.0, 0.4, 0.7]
    for name, pixels, most in (("yarns", np.repeat(shades[..., None], 3, 2), 0.12), ("lines", plain, 1.0)):
        imsave(tmp_path / f"{name}.png", pixels)
        raw = (tmp_path / f"{name}.png").read_bytes()
        kept = base64.b64decode(compress_picture(raw).removeprefix("data:image/webp;base64,"))
        with Image.open(io.BytesIO(kept)) as image:
            found = np.asarray(image.convert("RGB"), float) / 255.0
        assert len(kept) < most * len(raw)
        if name == "lines":
            np.testing.assert_allclose(found, plain, atol=0.5 / 255.0 + 1e-9)
        else:
            assert found.shape[1] == 1600 and found.mean() == pytest.approx(pixels.mean(), abs=0.005)
