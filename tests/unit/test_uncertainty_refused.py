"""Files of uncertainty that are refused, each where it is wrong; and what the page of a study shows."""

from pathlib import Path

import pytest
from browser import needs_browser, seen_on_a_phone
from calibration_cases import Pretending
from html_page import HtmlPage
from uncertainty_cases import STUDY, outcome, shearing, study, values

from knittest.base.errors import InputError
from knittest.cli.main import run
from knittest.config.yaml_loader import parse_document
from knittest.report_page.pictures import compress_picture
from knittest.studies.uncertainty.problem import problem_of

FOLDER = Path("runs/uncertainty-u")
FRICTION = "fabric.contact.friction_coefficient: {low: 0.1, high: 0.5, reason: glass on carbon as handbooks have it}"


def refused(old: str, new: str) -> str:
    """Message that refuses the study with ``new`` for ``old``."""
    assert old in STUDY
    with pytest.raises(InputError) as caught:
        problem_of(parse_document(STUDY.replace(old, new), "u.yaml"))
    return str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (", reason: glass on carbon as handbooks have it", "", "u.yaml:8: parameters.fabric.contact.friction_coeffic"),
        ("low: 0.1, high: 0.5", "low: 0.1, high: 2.5", "an end of the prior of fabric.contact.friction_coeff"),
        ("low: 0.1, high: 0.5", "kind: normal, mean: 0.3, sd: 0.1, low: 0", "every prior needs bounds"),
        ("contact.friction_coefficient", "contact.friction_coeff", 'did you mean "fabric.contact.friction_'),
        ("fabric.contact.friction_coefficient", "fabric.knitting.degree_of_set", "degree_of_set"),
        ("rig.max_angle: 45", "fabric.knitting.degree_of_set: 0.9", "degree_of_set: given twice, first at u.yaml:2"),
        ("reason: glass", "also: [fabric.knitting.degree_of_set], reason: glass", "given twice, first at u.yaml:8"),
        ("variant: 2}", "variant: 9}", "u.yaml:5: "),
        ("variant: 2}", "variant: 2, fabric: x.yaml}", "u.yaml:5: fabrics.V2: expected variant"),
        ("  V2: {", "  V/2: {", "expected a name without /"),
        (", fabric.reinforcing]", "]", "fabric.reinforcing.bending_stiffness.warp (V1 15.0, V2 28.8); so do "),
        ("differing_fields: [fabric.loop_length, ", "differing_fields: [fabric.loop, ",
         "fabrics differ in fabric.loop_length (V1 14.4"),
        ("ratios: [[V2, V1]]", "ratios: [[V2, V3]]", "quantities.force.ratios: 'V3': unknown fabric"),
        ("quantity: force, of", "quantity: forces, of", "statements.V2 below V1.quantity = 'forces': unknown quantity"),
        ("of: V2, below: V1", "of: V2, below: V3", "statements.V2 below V1.below: 'V3': unknown fabric"),
        ("samples: 16", "samples: 24", "u.yaml:15: samples = 24: expected a power of two, 16 or 32"),
    ],
)  # fmt: skip
def test_bad_files_are_refused_where_they_are_wrong(old, new, said):
    assert said in refused(old, new)


def test_parameters_that_are_there_only_together_are_taken_together():
    """Fields of a patch, which the fabric has not: radii of all kinds of crossing, or none."""
    told = "{low: 0.1, high: 0.3, reason: a reason of some length}"
    kinds = ("inlay_inlay", "inlay_loop", "loop_loop")
    lines = [f"  fabric.contact.patch.radius.{kind}: {told}\n" for kind in kinds]
    text = STUDY.replace("parameters:\n", "parameters:\n" + "".join(lines))
    problem = problem_of(parse_document(text, "u.yaml"))
    radius = problem.run("V1", [0.1, 0.2, 0.3, 0.3, 0.9]).fabric.contact.patch.radius
    assert [getattr(radius, f"{kind}_mm") for kind in kinds] == [0.1, 0.2, 0.3]
    assert "radius.loop_loop: missing" in refused("parameters:\n", "parameters:\n" + "".join(lines[:2]))


def test_fields_beside_a_parameter_take_its_value():
    waves = "fabric.reinforcing.crimp.warp: {low: 0.6, high: 0.9, also: [fabric.reinforcing.crimp.weft], reason: "
    text = STUDY.replace("fabric.contact.friction_coefficient: {low: 0.1, high: 0.5, reason: ", waves)
    crimp = problem_of(parse_document(text, "u.yaml")).run("V2", [0.65, 0.9]).fabric.reinforcing.crimp
    assert crimp.warp.value == crimp.weft.value == 0.65


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            "wrinkle_onset_deg",
            "wrinkle_onset",
            'no run has this result: unknown result (did you mean "wrinkle_onset_deg"?)',
        ),
        ("shear_force_n_at_deg", "shear_force", 'at 10, 20: unknown result (did you mean "shear_force_n_at_deg"?)'),
        ("at: [10, 20]", "at: [15, 25]", "no run has this result at 15, 25"),
    ],
)
def test_a_result_that_no_run_has_ends_the_study_with_the_first_run(tmp_path, monkeypatch, old, new, said):
    pool, given = Pretending(shearing), []
    taken = pool.run
    pool.run = lambda *arguments: (given.append(record) or record for record in taken(*arguments))
    with pytest.raises(InputError) as caught:
        study(STUDY.replace(old, new).replace("samples: 16", "samples: 2"), tmp_path, monkeypatch, pool)
    assert said in str(caught.value) and len(given) == 1


def test_priors_that_do_not_fit_each_other_are_refused(tmp_path, monkeypatch):
    """Each end of a prior passes beside the fabric's own numbers, and not together."""
    before, after = STUDY.split("parameters:\n  fabric")[0], STUDY[STUDY.index("quantities:") :]
    told = "reason: a reason of some length"
    thin = f"  fabric.knitting.beam_diameter: {{low: 0.2, high: 0.21, {told}}}\n"
    stiff = f"  fabric.knitting.bending_stiffness: {{low: 50, high: 60, {told}}}\n"
    pool = Pretending(shearing)
    with pytest.raises(InputError, match=r"thin tube.* \(at the medians of all priors"):
        study(f"{before}parameters:\n{thin}{stiff}{after}", tmp_path, monkeypatch, pool)
    assert pool.asked == [] and not FOLDER.exists()


def test_another_folder_is_left_alone(tmp_path, monkeypatch):
    here = tmp_path / FOLDER
    here.mkdir(parents=True)
    (here / "mine.txt").write_text("mine")
    with pytest.raises(InputError, match=r"holds mine.txt, but no study of uncertainty"):
        study(STUDY, tmp_path, monkeypatch)


def page_of() -> HtmlPage:
    page = HtmlPage(FOLDER / "report.html")
    page.check()
    return page


@pytest.fixture
def lost(tmp_path, monkeypatch) -> dict:
    """A study of which V2 has no result at large friction."""
    ends = ("completed", "refused")
    gone = Pretending(shearing, lambda t: ends[values(t)[0] > 0.45 and "v2" in t.run.fabric.name])
    assert study(STUDY, tmp_path, monkeypatch, gone, drawn=True) == 3
    return outcome(tmp_path)


@pytest.mark.filterwarnings("error")  # of matplotlib
def test_the_page_has_bands_shares_indices_priors_differences_and_what_was_lost(lost):
    page = page_of()
    bands = page.tables(page.section("bands"))["Percentiles over the prior"]
    assert [row[0] for row in bands[1:]] == [one["name"] for one in lost["variables"]]
    assert bands[3][4].endswith(" of 32") and bands[3][4] != bands[1][4] == "32 of 32"
    ((_, shares),) = page.tables(page.section("statements")).items()
    assert shares[1][1] == "force of V2 below V1 at 10, 20" and "for any result of the other" in shares[1][2]
    said = page.text(page.section("indices"))
    assert "No indices of V2/V1 force, 20:" in said and "First-order indices" in said
    priors = page.text(page.section("parameters"))
    assert "glass on carbon as handbooks have it" in priors and "uniform 0.1 to 0.5" in priors
    differing = page.tables(page.section("fabrics"))["Fields in which they differ; all others are equal"]
    assert ["fabric.loop_length", "14.4", "13.4"] in differing
    gone = page.text(page.section("lost"))
    assert "refused on purpose" in gone and f"Runs that lack a result: {len(lost['lost'])}" in gone
    assert "have no valid result" in page.text(page.section("summary"))
    pictures = [compress_picture((FOLDER / name).read_bytes()) for name in ("bands.png", "indices.png")]
    assert [e.get("src") for e in page.all("img")] == pictures
    before = (FOLDER / "report.html").read_bytes()
    assert run(["report", str(FOLDER)]) == 0 and (FOLDER / "report.html").read_bytes() == before


def test_damage_costs_its_own_part_only(lost):
    (FOLDER / "uncertainty.json").write_text('{"uncertainty": "u", "variables": [{"name": 3}], "runs": 5}')
    (FOLDER / "bands.png").write_bytes(b"broken")
    assert run(["report", str(FOLDER)]) == 0
    said = page_of().text()
    assert "Missing or not readable: uncertainty.json: variables" in said and "There are no variables" in said


@needs_browser
def test_a_phone_shows_it(lost, tmp_path):
    seen = seen_on_a_phone(FOLDER / "report.html", tmp_path)
    assert seen["heading"] == "Uncertainty u" and seen["wide"] <= seen["window"] <= 390
    assert seen["images"] == seen["shown"] == 2
