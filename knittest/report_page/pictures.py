"""Pictures of a run folder, carried inside the page."""

import base64

from knittest.errors import InputError
from knittest.reading import read_regular
from knittest.report_page.blocks import Block, Picture, Section, Text
from knittest.report_page.loading import LoadedRun

MAX_BYTES = 8_000_000
MOST = 20
SIGNATURE = b"\x89PNG\r\n\x1a\n"
CAPTIONS = {
    "deformed.png": "The specimen, deformed",
    "wrinkles.png": "Height of the wrinkles",
    "shear-angle.png": "Shear angle of the material against that of the frame",
    "pressure.png": "Contact pressure of the plates",
    "energies.png": "Energies and their ratios over time; what is shaded is not judged",
    "curve.png": "The curve as the run drew it, with every specimen and every curve it was compared with",
}


def pictures(run: LoadedRun, curve_complete: bool) -> Section:
    """All PNG files of the folder; curve.png only where the page's own chart is not ``curve_complete``."""
    blocks: list[Block] = []
    names = sorted((p.name for p in run.path.glob("*.png")), key=lambda n: (n not in CAPTIONS, n))
    if curve_complete:
        names = [name for name in names if name != "curve.png"]
    for name in names[:MOST]:
        try:
            raw = read_regular(run.path / name, MAX_BYTES, "too large for a page")
        except InputError as error:
            blocks.append(Text(str(error), "warn"))
            continue
        if not raw.startswith(SIGNATURE):
            blocks.append(Text(f"{name}: not a PNG picture", "warn"))
            continue
        caption = CAPTIONS.get(name, name)
        blocks.append(Picture(data_uri(raw, "image/png"), f"{caption} ({name})", f"{caption} ({name})", wide=True))
    if len(names) > MOST:
        blocks.append(Text(f"{len(names) - MOST} more pictures lie in the run folder."))
    return Section(f"run-{run.number}-pictures", "Pictures", blocks or [Text("This run left no pictures.")])


def data_uri(raw: bytes, media_type: str) -> str:
    """``raw`` as a URI that needs no file."""
    return f"data:{media_type};base64,{base64.b64encode(raw).decode('ascii')}"
