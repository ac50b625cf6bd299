"""``knittest report`` of a real run, and its page in a real browser where one is installed."""

import json
import shutil
import subprocess
from pathlib import Path

import pytest
from html_page import HtmlPage, near

from knittest.cli.main import run as command

BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
#: shows a page as wide as a phone and writes into its own title what a reader would see
FRAME = """<!DOCTYPE html><title>nothing</title><iframe src="{page}" width="390" height="800"></iframe><script>
addEventListener("load", () => {{
  const inside = document.querySelector("iframe").contentDocument;
  const images = [...inside.images];
  document.title = JSON.stringify({{
    wide: inside.documentElement.scrollWidth, window: inside.documentElement.clientWidth,
    images: images.length, shown: images.filter(i => i.complete && i.naturalWidth > 50).length,
    heading: inside.querySelector("h1").innerText,
  }});
}});
</script>"""


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("runs") / "plates"
    arguments = ["--variant", "1", "--scale", "macro", "--preset", "quick", "--direction", "warp", "--no-frames"]
    assert command(["friction", *arguments, "--quiet", "--threads", "1", "--out", str(folder)]) == 0
    return folder


def test_a_run_writes_its_own_page(finished: Path) -> None:
    page = HtmlPage(finished / "report.html")
    page.check()
    summary = json.loads((finished / "summary.json").read_text())
    shown = page.numbers(page.section("run-1-results"))
    assert all(near(value, shown) for value in summary["results"].values())
    provenance = dict(page.tables()["Provenance"])
    assert provenance["status"] == "completed, exit code 0" and provenance["ended"]
    assert "Missing or not readable" not in page.text()
    captions = [" ".join("".join(c.itertext()).split()) for c in page.all("figcaption")]
    assert [c for c in captions if c.endswith("(energies.png)")]


def test_a_second_page_on_demand_is_the_same(finished: Path) -> None:
    before = (finished / "report.html").read_bytes()
    assert command(["report", str(finished)]) == 0
    assert (finished / "report.html").read_bytes() == before


@pytest.mark.skipif(BROWSER is None, reason="no chromium or chrome is installed")
def test_a_browser_shows_it_on_a_phone_and_prints_it(finished: Path, tmp_path: Path) -> None:
    page = finished / "report.html"
    (tmp_path / "frame.html").write_text(FRAME.format(page=page.as_uri()))
    dom = _browse(tmp_path, "--dump-dom", (tmp_path / "frame.html").as_uri())
    seen = json.loads(dom.partition("<title>")[2].partition("</title>")[0].replace("&quot;", '"'))
    assert seen["heading"] == "friction, pham2019-v1, macro, warp"
    assert seen["wide"] <= seen["window"] <= 390
    assert seen["images"] == seen["shown"] == len(HtmlPage(page).pictures()) > 1
    _browse(tmp_path, f"--print-to-pdf={tmp_path / 'page.pdf'}", page.as_uri())
    assert (tmp_path / "page.pdf").read_bytes().startswith(b"%PDF")


def _browse(folder: Path, *arguments: str) -> str:
    """Standard output of the browser without window, network and profile of its own."""
    fixed = ("--headless", "--no-sandbox", "--disable-gpu", "--disable-web-security", "--allow-file-access-from-files")
    options = [*fixed, f"--user-data-dir={folder / 'profile'}", "--virtual-time-budget=5000", *arguments]
    return subprocess.run([str(BROWSER), *options], capture_output=True, text=True, timeout=120, check=True).stdout
