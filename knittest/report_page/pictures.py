"""Pictures of a run folder and fields of several runs, embedded in the page and compressed."""

import base64
import io
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from knittest.base.errors import InputError
from knittest.base.figure import png
from knittest.base.files import read_regular
from knittest.export.field_pictures import PlanField, fields_figure
from knittest.report_page.blocks import Block, Picture, Section, Text
from knittest.report_page.loaded_run import LoadedRun

if TYPE_CHECKING:
    from matplotlib.figure import Figure


MAX_BYTES = 40_000_000
MOST_PICTURES = 20
#: largest width of a picture on a page [pixel]
LARGEST_WIDTH = 1600
#: bytes per pixel above which a PNG file is a shaded picture, and the WebP quality of those (of 100)
SHADED, KEPT = 0.15, 88
#: width up to which a picture keeps its size [pixel]
NARROW_WIDTH = 700
SIGNATURE = b"\x89PNG\r\n\x1a\n"
CAPTIONS = {
    "deformed.png": "The specimen, deformed",
    "wrinkles.png": "Height of the wrinkles",
    "shear-angle.png": "Shear angle of the material",
    "zones.png": "Shear angle in the zones of the strip",
    "draw-in.png": "Draw-in of the edge of the blank",
    "yarn-forces.png": "Largest tension of every yarn over its strength",
    "stamp-work.png": "Work of the stamp by mechanism",
    "pressure.png": "Contact pressure of the plates",
    "energies.png": "Energies and their ratios over time; not checked in the shaded range",
    "compare.png": "Curve with a reference added after the run",
    "curve.png": "Curve with all specimens and all references",
}


def pictures(run: LoadedRun, curve_complete: bool, above: frozenset[str]) -> Section:
    """Section with the PNG files of the folder, except those shown ``above``, and curve.png if it adds nothing."""
    blocks: list[Block] = []
    names = sorted((p.name for p in run.path.glob("*.png")), key=lambda n: (n not in CAPTIONS, n))
    names = [name for name in names if not (curve_complete and name == "curve.png")]
    shown = [name for name in names if name in above]
    names = [name for name in names if name not in above]
    blocks += [Text(f"Shown above with the other runs: {', '.join(shown)}.")] if shown else []
    for name in names[:MOST_PICTURES]:
        early = ", when the run ended early" if ".incomplete." in name else ""
        blocks.append(picture(run.path / name, CAPTIONS.get(name.replace(".incomplete.", "."), name) + early))
    if len(names) > MOST_PICTURES:
        blocks.append(Text(f"The run folder has {len(names) - MOST_PICTURES} more pictures."))
    return Section(f"run-{run.number}-pictures", "Pictures", blocks or [Text("This run has no pictures.")])


def picture(path: Path, caption: str) -> Block:
    """The PNG file ``path`` as a picture, or a notice why it cannot be shown."""
    try:
        raw = read_regular(path, MAX_BYTES, "too large for a page")
    except InputError as error:
        return Text(str(error), "warn")
    if not raw.startswith(SIGNATURE):
        return Text(f"{path.name}: not a PNG picture", "warn")
    try:
        uri = compress_picture(raw)
    except Exception as error:  # whatever the decoder meets in a damaged file
        return Text(f"{path.name}: cannot be read as PNG ({error})", "warn")
    named = f"{caption} ({path.name})"
    return Picture(uri, named, named, wide=int.from_bytes(raw[16:20]) > NARROW_WIDTH)


def compress_picture(png: bytes) -> str:
    """The ``png`` file as a WebP URI: drawings without loss, shaded pictures with a small one."""
    from PIL import Image

    with Image.open(io.BytesIO(png)) as opened:
        image = Image.new("RGB", opened.size, "white")
        image.paste(opened.convert("RGB"), mask=opened.convert("RGBA").getchannel("A"))
    shaded = len(png) > SHADED * image.width * image.height
    if image.width > LARGEST_WIDTH:
        image.thumbnail((LARGEST_WIDTH, image.height), Image.Resampling.LANCZOS)
    buffer = io.BytesIO()
    image.save(buffer, "WEBP", lossless=not shaded, quality=KEPT)
    return data_uri(buffer.getvalue(), "image/webp")


def data_uri(raw: bytes, media_type: str) -> str:
    """``raw`` as a data URI."""
    return f"data:{media_type};base64,{base64.b64encode(raw).decode('ascii')}"


#: table of the shear angles of a run, and its columns
FILE, COLUMNS = "shear-field.csv", ("x_mm", "y_mm", "shear_angle_deg")
LABEL, TITLE = "shear angle [deg]", "Shear angle of the material at the end, in plan"
#: most runs in a row, and largest table [byte]
MOST_FIELDS, MAX_FIELD_BYTES = 4, 30_000_000


def fields(runs: Sequence[LoadedRun]) -> list[Block]:
    """Picture of the shear angles of ``runs`` of one test in plan, where two or more have them."""
    figure, problems = fields_figure_of(runs)
    blocks: list[Block] = [Text(problem, "warn") for problem in problems]
    if figure is None:
        return blocks
    caption = f"{TITLE}: one colour scale; lower row: difference from the first run"
    try:
        uri = compress_picture(png(figure))
    except Exception as error:  # of any kind in the encoder
        return [Text(f"{caption}: cannot be drawn ({error})", "warn"), *blocks]
    return [Picture(uri, caption, caption, wide=True), *blocks]


def fields_figure_of(runs: Sequence[LoadedRun]) -> "tuple[Figure | None, list[str]]":
    """Figure of the shear angles of the first runs that have them, None for fewer than two, and problems of others."""
    found: list[PlanField] = []
    problems = []
    for run in runs:
        path = run.path / FILE
        if not path.is_file() or len(found) == MOST_FIELDS:
            continue
        try:
            lines = read_regular(path, MAX_FIELD_BYTES, "too large for a page").decode("utf-8").splitlines()
            table = np.array([[float(v) for v in line.split(",")] for line in lines[1:]])
            if tuple(lines[0].split(",")) != COLUMNS or table.shape[1:] != (3,) or not np.isfinite(table[:, :2]).all():
                raise ValueError(f"expected the columns {', '.join(COLUMNS)}")
        except (InputError, ValueError, IndexError) as error:
            problems.append(f"{path}: {error}")
            continue
        scale = run.summary.scale or run.setting("model", "scale") or ""
        found.append(PlanField(f"run {run.number}, {scale}", table[:, :2], table[:, 2]))
    return fields_figure(found, title=TITLE, label=LABEL) if len(found) > 1 else None, problems
