"""Pictures of the gallery, made by the lines that docs/gallery.md shows above them. In a checkout:

python -m docs.gallery            runs all of them, a run that several pictures need once
python -m docs.gallery frame cell      those of these names
"""

import re
import sys
import tempfile
from contextlib import chdir
from pathlib import Path
from typing import Any

from PIL import Image

HERE = Path(__file__).parent
SHOWN = re.compile(r"^```python\n(.*?)^```\n\n!\[[^\]]*\]\(gallery/([\w-]+)\.png\)$", re.M | re.S)


def shown() -> dict[str, str]:
    """Lines of each picture by its name."""
    text = (HERE / "gallery.md").read_text(encoding="utf-8")
    return {name: lines for lines, name in SHOWN.findall(text)}


def main(names: list[str]) -> int:
    """Make the pictures ``names``, or all; returns the exit code."""
    chosen = {name: lines for name, lines in shown().items() if name in names or not names}
    if unknown := set(names) - set(chosen):
        print(f"{', '.join(sorted(unknown))}: no picture of the gallery, which has {', '.join(shown())}")
        return 2
    left: dict[str, Any] = {}  # run by the line that makes it
    with tempfile.TemporaryDirectory() as place, chdir(place):
        for name, lines in chosen.items():
            scope = made(lines, left)
            keep(scope["picture"], HERE / "gallery" / f"{name}.png")
            print(f"docs/gallery/{name}.png")
    return 0


def keep(picture: Path, place: Path) -> None:
    """Copy ``picture`` to ``place``, at most 1200 pixels a side and 256 colours: pages are to be light."""
    with Image.open(picture) as full:
        small = full.convert("RGB")
        small.thumbnail((1200, 1200))
        small.quantize(256).save(place, optimize=True)


def made(lines: str, left: dict[str, Any]) -> dict[str, Any]:
    """Names that ``lines`` leave; a run that is in ``left`` already is not repeated, a new one is put there."""
    (call,) = re.findall(r"^run = .*$", lines, re.M)
    scope: dict[str, Any] = {"run": left[call]} if call in left else {}
    exec(lines.replace(call, "") if call in left else lines, scope)
    left[call] = scope["run"]
    return scope


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
