"""Pages of several runs: parents are expanded, results and differences stand side by side, every run has its part."""

import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from html_page import HtmlPage, near
from report_sample import RESULTS, write_run

from knittest.base.errors import InputError
from knittest.cli.main import run as command
from knittest.config.loading import resolve
from knittest.laboratory.report_base import REPORTS
from knittest.report_page import folders
from knittest.report_page.page import write_reports


@pytest.fixture(scope="module")
def parent(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of both directions, beside runs of other tests."""
    root = tmp_path_factory.mktemp("both")
    write_run(root / "tensile" / "warp")
    write_run(root / "tensile" / "weft", direction="weft", results={"peak_force_n": 6232.875})
    write_run(root / "meso", scale="meso", sets=("solver.damping=0.25", "fabric.contact.friction_coefficient=0.2"))
    write_run(root / "plates", "friction")
    return root


def page_of(paths: list[Path], out: Path) -> HtmlPage:
    page = HtmlPage(write_reports(paths, out)[0])
    page.check()
    return page


def test_a_folder_of_both_directions_is_expanded(parent: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert command(["report", str(parent / "tensile")]) == 0
    output = capsys.readouterr()
    assert output.out == f"{parent / 'tensile' / 'report.html'}\n" and "2 runs" in output.err
    page = HtmlPage(parent / "tensile" / "report.html")
    page.check()
    (rows,) = page.tables(page.section("overview")).values()
    assert [row[1] for row in rows[1:]] == [f"tensile, pham2019-v1, macro, {d} tensile/{d}" for d in ("warp", "weft")]


def test_results_stand_side_by_side_with_their_change(parent: Path, tmp_path: Path) -> None:
    page = page_of([parent / "tensile", parent / "meso"], tmp_path / "page.html")
    (rows,) = page.tables(page.section("comparison")).values()
    assert rows[0] == ["quantity", "run 1 (warp)", "run 2 (weft)", "run 3 (warp)"]
    peak = rows[1]
    assert peak[:2] == ["peak force [N]", "5666 -0.33 sd, input"]
    assert peak[2].startswith("6233 +10.0 %, ") and peak[2].endswith("input") and peak[3].endswith("tuned")
    shown = page.numbers(page.section("comparison"))
    assert near(6232.875, shown) and near(RESULTS["tensile"]["fracture_strain_pct"], shown)


def test_pictures_of_runs_of_one_test_stand_beside_each_other(parent: Path, tmp_path: Path) -> None:
    page = page_of([parent / "tensile", parent / "plates"], tmp_path / "page.html")
    captions = [str(e.text) for e in page.all("figcaption") if str(e.text).startswith("Run ")]
    assert captions == [f"Run {k}: the specimen, deformed (deformed.png)" for k in (1, 2)]
    for k in (1, 2):  # not a second time
        part = page.section(f"run-{k}-pictures")
        assert "Shown above with the other runs: deformed.png" in page.text(part)
    assert len([raw for raw in page.pictures() if raw.startswith(b"RIFF")]) == 3  # of them one of the friction


def test_only_what_differs_is_listed(parent: Path, tmp_path: Path) -> None:
    page = page_of([parent / "tensile" / "warp", parent / "meso"], tmp_path / "page.html")
    tables = page.tables(page.section("differences"))
    rows = {row[0]: row[1:] for row in tables["tensile: parameters and settings that differ"]}
    assert rows["fabric.contact.friction_coefficient"] == ["0.3 (assumed)", "0.2 (user)"]
    assert rows["solver.damping"] == ["0.5 1/ms", "0.25 1/ms"]
    assert rows["model.scale"] == ["macro", "meso"] and "rig.width" not in rows
    assert "Provenance that differs: none." in page.text(page.section("differences"))


def test_every_run_has_its_part_and_curves_of_one_test_share_a_picture(parent: Path, tmp_path: Path) -> None:
    page = page_of([parent], tmp_path / "page.html")
    links = [a.get("href") for a in page.section("overview").iter("a")]
    assert links == [f"#run-{n}" for n in range(1, 5)]
    for number in range(1, 5):
        for part in ("results", "curve", "gates", "parameters", "pictures", "repeat"):
            assert page.section(f"run-{number}-{part}") is not None
    assert "run 3" in page.text(page.section("comparison"))
    friction, tensile = (raw.decode() for raw in page.pictures()[:2])
    assert "<!-- run 2, warp macro -->" in friction and "run 1" not in friction
    reference = "reconstructed (Table 3 of Pham et al. 2019, variant 1, warp)"
    for label in ("run 1, warp meso", "run 3, warp macro", "run 4, weft macro", reference):
        assert f"<!-- {label} -->" in tensile


def test_runs_are_told_once_and_planned_ones_named(parent: Path, tmp_path: Path) -> None:
    both = Path(shutil.copytree(parent / "tensile", tmp_path / "both"))
    shutil.rmtree(both / "weft")
    for name in ("warp", "weft"):
        (both / f"config-{name}.yaml").write_text("x: 1\n")
    page = page_of([both, both / "warp"], tmp_path / "page.html")
    assert "1 runs" in page.tables() and "both: weft is planned but has no run yet" in page.text()


def test_a_damaged_trial_of_a_sweep_stops_no_page_but_a_named_one_does(parent: Path, tmp_path: Path) -> None:
    sweep = tmp_path / "sweep"
    shutil.copytree(parent / "plates", sweep / "trials" / "a" / "warp")
    (sweep / "trials" / "b").mkdir()
    (sweep / "trials" / "b" / "manifest.json").write_text("{")
    page = page_of([sweep], tmp_path / "page.html")
    assert "b: not a run folder of knittest: manifest.json: cannot be read" in page.text(page.section("overview"))
    with pytest.raises(InputError, match="not a run folder of knittest"):
        write_reports([parent / "plates", sweep / "trials" / "b"], tmp_path / "none.html")
    assert not (tmp_path / "none.html").exists()


def test_a_page_of_several_lies_in_the_working_folder_and_has_its_limit(parent, tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(folders, "MOST_RUNS", 3)
    with pytest.raises(InputError, match="4 runs: expected at most 3 on a page"):
        write_reports([parent], tmp_path / "page.html")
    monkeypatch.chdir(tmp_path)
    path, count = write_reports([parent / "tensile" / "warp", parent / "plates"], None)
    assert (path, count) == (Path("knittest-report.html"), 2) and path.is_file()


def test_runs_of_several_widths_are_compared_by_force_per_width(tmp_path: Path) -> None:
    """50 and 100 mm: forces [N] have no change, those per width have; the picture is in N/mm, experiment included."""
    for width in (50, 100):
        results = {"peak_force_n": 120.0 * width, "peak_force_n_per_mm": 120.0}
        folder = write_run(tmp_path / f"w{width}", sets=(f"rig.width={width}",), results=results)
        strain = np.linspace(0.0, 1.6, 50)
        pd.DataFrame({"strain_pct": strain, "force_n": 120.0 * width * strain}).to_csv(
            folder / "curve.csv", index=False
        )
    page = page_of([tmp_path / "w50", tmp_path / "w100"], tmp_path / "page.html")
    rows = {row[0]: row[1:] for row in next(iter(page.tables(page.section("comparison")).values()))}
    assert rows["peak force [N]"][1].startswith("12000 different size")
    assert rows["peak force per width [N/mm]"] == ["120.0", "120.0"]
    drawn = page.pictures()[0].decode()
    assert "<!-- force per width [N/mm] -->" in drawn and "<!-- force [N] -->" not in drawn
    same = page_of([tmp_path / "w50", tmp_path / "w50"], tmp_path / "same.html")
    assert "different size" not in same.text()


def test_curves_free_of_size(tmp_path: Path) -> None:
    """Force per width of whole yarns: 15 mm at 28 in 100 mm hold 4 of 4.2; a frame's own column is normalised."""
    strip = resolve(variant="1", scale="meso", test="tensile", direction="warp", sets=["rig.width=15"])
    axes, found = REPORTS["tensile"].size_free_curve(
        strip, {"strain_pct": np.ones(2), "force_n": np.array([0.0, 400.0])}
    )
    assert found["force_n"][1] == pytest.approx(400.0 / (4 / 0.28)) and axes.ylabel == "force per width [N/mm]"
    assert found["strain_pct"].tolist() == [1.0, 1.0]
    frame = resolve(variant="1", scale="macro", test="picture-frame", sets=["rig.side=140", "rig.frame_side=216"])
    size, told = REPORTS["picture-frame"].size(frame)
    assert size == pytest.approx(140.0**2 / 216.0) and told == "square of 140 mm in a frame of 216 mm"
    assert REPORTS["picture-frame"].size_free_curve(frame, {})[0].y == "normalised_shear_force_n_per_mm"
