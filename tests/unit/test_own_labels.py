"""Labels of a fabric of one's own: its own sources, and what is another fabric's as assumed."""

from pathlib import Path

import pytest
from html_page import HtmlPage
from report_sample import write_run

from knittest.config.loading import resolve
from knittest.config.templates import copy_as_assumed, fabric_template
from knittest.experiment.curves import ReferenceCurve
from knittest.laboratory import strips
from knittest.laboratory.report_base import REPORTS, run_stamp, title_of
from knittest.report_page.page import write_report, write_reports
from knittest.solve.state import Observer

TABLE = """variant,direction,quantity,mean,sd,n,unit,table
mine,,strip_width_mm,100,,,mm,strips of mine
mine,warp,peak_force_n,9000,300,5,N,five strips of mine
mine,warp,fracture_strain_pct,1.7,0.1,5,%,five strips of mine
mine,warp,overhang_mm,160,5,5,mm,five strips of mine
mine,,mu_paper,0.2,0.01,5,1,five strips of mine
"""
CURVE = """# kind: measured
# source: five strips of mine, warp
# strip_width_mm: 100
strain_pct,force_n_per_mm
0,0
0.8,30
1.7,90
"""
PAPER = ("Table 3", "Table 1", "Pham", "variant 1", "as published")


@pytest.fixture
def own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The fabric ``mine`` with variant 1's numbers, assumed, an experiment and tension curves of its own."""
    monkeypatch.chdir(tmp_path)
    like = resolve(variant="1", parameters="as-measured").fabric
    (tmp_path / "configs").mkdir()
    (tmp_path / "configs/mine.yaml").write_text(fabric_template(copy_as_assumed(like, "mine"), like.name))
    (tmp_path / "data/mine").mkdir(parents=True)
    (tmp_path / "data/mine/results.csv").write_text(TABLE)
    (tmp_path / "data/mine-warp.csv").write_text(CURVE)
    file = tmp_path / "configs/mine.yaml"
    text = file.read_text().replace("experiment: null", "experiment: mine").replace("_variant: null", "_variant: mine")
    for direction in ("warp", "weft"):
        text = text.replace(f"pham2019/curves/tensile-v1-{direction}.csv", "mine-warp.csv")
    file.write_text(text)
    return tmp_path


def shown(page: HtmlPage) -> str:
    """The page without the parts that name what was taken over, which are judged by themselves."""
    kept = [e for e in page.all("section") if str(e.get("id")).endswith(("-repeat", "-parameters"))]
    whole = page.text()
    for section in kept:
        whole = whole.replace(page.text(section), "")
    return whole


@pytest.mark.parametrize("kind", ["tensile", "picture-frame", "cantilever", "friction", "forming"])
@pytest.mark.parametrize("scale", ["macro", "meso"])
def test_the_page_of_an_own_fabric_cites_its_own_experiment_only(own: Path, kind: str, scale: str) -> None:
    sets = ["rig.mode=overhang"] if kind == "cantilever" else []
    page = HtmlPage(write_report(write_run(own / "r", kind, variant="mine", scale=scale, sets=sets)))
    text = shown(page)
    assert not [word for word in PAPER if word in text]
    assert "shipped" not in text
    if kind in ("tensile", "cantilever", "friction"):
        assert "five strips of mine" in text
        kinds = {row[-1] for caption, rows in page.tables().items() if "Results" in caption for row in rows[1:]} - {"-"}
        assert kinds == {"assumed"}  # the template's numbers, and its friction


def test_the_law_of_another_fabric_is_assumed_whatever_the_file_says(own: Path) -> None:
    text = (own / "configs/mine.yaml").read_text()
    for source in ("predicted", "assumed"):
        text = text.replace(f'source: "{source}"', 'source: "measured"')
    (own / "configs/mine.yaml").write_text(text)
    assert resolve(test="tensile", variant="mine", scale="macro").fabric.macro.shear.source == "measured"
    runs = [write_run(own / name, "picture-frame", variant=name, scale="macro") for name in ("mine", "1")]
    page = HtmlPage(write_report(runs[0]))
    tables = page.tables(page.section("run-1-parameters"))
    rows = {
        caption.split(":")[0]: {row[0].split()[0]: row[2] for row in rows if len(row) > 2}
        for caption, rows in tables.items()
    }
    assert rows["Assumed"]["macro.shear"].startswith(
        "curve of pham2019-v1, by its header; the fabric file states measured"
    )
    assert not any("macro.shear" in found for source, found in rows.items() if source != "Assumed")
    both, _ = write_reports(runs, own / "both.html")
    differing = "".join(HtmlPage(both).tree.itertext())
    assert "shear-v1-simulated.csv (assumed)" in differing and "shear-v1-simulated.csv (measured)" not in differing


def test_another_fabrics_tension_is_assumed_for_shells_and_no_reference_for_yarns(own: Path) -> None:
    text = (own / "configs/mine.yaml").read_text().replace("mine-warp.csv", "pham2019/curves/tensile-v1-warp.csv")
    (own / "configs/mine.yaml").write_text(text)
    page = HtmlPage(write_report(write_run(own / "r", variant="mine")))
    tables = page.tables(page.section("run-1-parameters"))
    (assumed,) = (rows for caption, rows in tables.items() if caption.startswith("Assumed"))
    assert [
        "macro.tension.warp",
        "pham2019/curves/tensile-v1-warp.csv",
        "curve of pham2019-v1, by its header",
    ] in [[row[0].split()[0], *row[1:]] for row in assumed]
    found: dict[str, ReferenceCurve | None] = {}
    for scale in ("macro", "meso"):
        run = resolve(test="tensile", variant="mine", scale=scale, direction="warp")
        found[scale] = REPORTS["tensile"].reference_curve(run)
    assert found["meso"] is None
    assert found["macro"] is not None and "assumed: of pham2019-v1" in found["macro"].source
    theirs = REPORTS["tensile"].reference_curve(resolve(test="tensile", variant="1", scale="meso", direction="warp"))
    assert theirs is not None and "assumed" not in theirs.source


def test_the_study_of_speed_is_shown_for_the_fabric_it_was_made_with(own: Path) -> None:
    for variant, there in (("1", True), ("2", False), ("mine", False)):
        page = HtmlPage(write_report(write_run(own / f"r{variant}", "friction", variant=variant)))
        tables = page.tables(page.section("run-1-studies"))
        assert any("halved" in caption for caption in tables) is there
        assert ("was not studied for this fabric" in page.text()) is not there


def test_a_fabric_without_parameter_sets_is_said_to_be_as_in_its_file(own: Path) -> None:
    run = resolve(test="tensile", variant="mine", scale="macro", direction="warp")
    assert run.parameters == "base"
    said = [title_of(run), *run_stamp(run, ()).facts]
    said.append(HtmlPage(write_report(write_run(own / "r", variant="mine"))).text())
    assert "mine, tensile warp, macro (as in the fabric file)" in said
    assert "parameters as in the fabric file" in said and "parameter set as in the fabric file" in said[-1]
    assert not [text for text in said if "(base)" in text or "parameters base" in text]
    paper = resolve(test="tensile", variant="1", scale="macro", direction="warp")
    assert title_of(paper).endswith("(calibrated)")


def test_the_yarns_are_announced_as_laid_out_after_the_cell_was_relaxed(own: Path, monkeypatch) -> None:
    """The cell of a run was relaxed, and said to be, before its folder was opened."""

    class Reached(Exception):
        pass

    def relaxed(fabric):
        raise Reached

    monkeypatch.setattr(strips, "relaxed_cell", relaxed)
    phases: list[str] = []

    class Listener(Observer):
        def phase(self, text: str) -> None:
            phases.append(text)

    with pytest.raises(Reached):
        strips.cut_piece(
            resolve(test="tensile", variant="1", scale="meso", direction="warp"), 2, 2, observer=Listener()
        )
    assert phases == ["generating the yarns"]
