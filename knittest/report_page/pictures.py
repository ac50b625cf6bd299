"""Pictures of a run folder, carried inside the page, recoded so that it stays light."""

import base64
import io
from pathlib import Path

from knittest.base.errors import InputError
from knittest.base.reading import read_regular
from knittest.report_page.blocks import Block, Picture, Section, Text
from knittest.report_page.loading import LoadedRun

MAX_BYTES = 40_000_000
MOST = 20
#: pixels across that a page shows at most
WIDEST = 1600
#: bytes of a PNG file a pixel above which it is no drawing of lines and plain faces, and how well it is kept [of 100]
SHADED, KEPT = 0.15, 88
#: pixels up to which a picture is not widened to that of the page
NARROW = 700
SIGNATURE = b"\x89PNG\r\n\x1a\n"
CAPTIONS = {
    "deformed.png": "The specimen, deformed",
    "wrinkles.png": "Height of the wrinkles",
    "shear-angle.png": "Shear angle of the material",
    "zones.png": "Shear angle in the zones of the strip",
    "draw-in.png": "Draw-in of the edge of the blank",
    "yarn-forces.png": "Largest tension of every yarn over its strength",
    "stamp-work.png": "What the work of the stamp went into, mechanism by mechanism",
    "pressure.png": "Contact pressure of the plates",
    "energies.png": "Energies and their ratios over time; what is shaded is not judged",
    "compare.png": "The curve beside one that it was compared with later",
    "curve.png": "The curve as the run drew it, with every specimen and every curve it was compared with",
}


def pictures(run: LoadedRun, curve_complete: bool, above: frozenset[str]) -> Section:
    """All PNG files of the folder but those ``above``, which are named; curve.png only where the page's own chart is
    not ``curve_complete``.
    """
    blocks: list[Block] = []
    names = sorted((p.name for p in run.path.glob("*.png")), key=lambda n: (n not in CAPTIONS, n))
    if curve_complete:
        names = [name for name in names if name != "curve.png"]
    beside = [name for name in names if name in above]
    names = [name for name in names if name not in above]
    blocks += [Text(f"Beside those of the other runs, above: {', '.join(beside)}.")] if beside else []
    blocks += [picture(run.path / name, _caption(name)) for name in names[:MOST]]
    if len(names) > MOST:
        blocks.append(Text(f"{len(names) - MOST} more pictures lie in the run folder."))
    return Section(f"run-{run.number}-pictures", "Pictures", blocks or [Text("This run left no pictures.")])


def _caption(name: str) -> str:
    """Caption of the picture ``name``, which says whether the run ended early."""
    caption = CAPTIONS.get(name.replace(".incomplete.", "."), name)
    return f"{caption}, when the run ended early" if ".incomplete." in name else caption


def picture(path: Path, caption: str) -> Block:
    """The PNG file ``path`` as the page carries it, or a notice why it cannot be shown."""
    try:
        raw = read_regular(path, MAX_BYTES, "too large for a page")
    except InputError as error:
        return Text(str(error), "warn")
    if not raw.startswith(SIGNATURE):
        return Text(f"{path.name}: not a PNG picture", "warn")
    try:
        uri = light(raw)
    except Exception as error:  # whatever the decoder meets in a damaged file
        return Text(f"{path.name}: cannot be read as PNG ({error})", "warn")
    named = f"{caption} ({path.name})"
    return Picture(uri, named, named, wide=int.from_bytes(raw[16:20]) > NARROW)


def light(png: bytes) -> str:
    """The ``png`` file as a WebP URI: drawings without loss, shaded yarns and fields with one that is not seen."""
    from PIL import Image

    with Image.open(io.BytesIO(png)) as opened:
        image = Image.new("RGB", opened.size, "white")
        image.paste(opened.convert("RGB"), mask=opened.convert("RGBA").getchannel("A"))
    shaded = len(png) > SHADED * image.width * image.height
    if image.width > WIDEST:
        image.thumbnail((WIDEST, image.height), Image.Resampling.LANCZOS)
    buffer = io.BytesIO()
    image.save(buffer, "WEBP", lossless=not shaded, quality=KEPT)
    return data_uri(buffer.getvalue(), "image/webp")


def data_uri(raw: bytes, media_type: str) -> str:
    """``raw`` as a URI that needs no file."""
    return f"data:{media_type};base64,{base64.b64encode(raw).decode('ascii')}"
