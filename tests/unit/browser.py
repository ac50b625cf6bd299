"""Shows pages in a real browser, where one is installed."""

import json
import os
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

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
#: set by .ci/run, where a skip would go unseen: without a browser these tests then fail
REQUIRED = bool(os.environ.get("KNITTEST_TEST_BROWSER"))
needs_browser = pytest.mark.skipif(BROWSER is None and not REQUIRED, reason="no chromium or chrome is installed")


def seen_on_a_phone(page: Path, folder: Path) -> dict[str, Any]:
    """View of ``page``, as a reader has it, on a screen 390 pixels wide; files of the browser go to ``folder``."""
    (folder / "frame.html").write_text(FRAME.format(page=page.resolve().as_uri()))
    dom = browse(folder, "--dump-dom", (folder / "frame.html").as_uri())
    seen: dict[str, Any] = json.loads(dom.partition("<title>")[2].partition("</title>")[0].replace("&quot;", '"'))
    return seen


def browse(folder: Path, *arguments: str) -> str:
    """Standard output of the browser without window, network and profile of its own."""
    fixed = ("--headless", "--no-sandbox", "--disable-gpu", "--disable-web-security", "--allow-file-access-from-files")
    options = [*fixed, f"--user-data-dir={folder / 'profile'}", "--virtual-time-budget=5000", *arguments]
    return subprocess.run([str(BROWSER), *options], capture_output=True, text=True, timeout=120, check=True).stdout
