"""Reads the keyword files that decks are, by the columns of the target's manual, and prepares small specimens."""

from collections import defaultdict

from knittest.config.loading import resolve_test_runs
from knittest.runs.deck.deck_file import deck_of
from knittest.runs.specimen import prepare

BEAM = {"variant": "1", "scale": "meso", "preset": "quick"}
SHELL = {"variant": "1", "scale": "macro", "preset": "quick"}


def cards_of(text):
    """Cards of each keyword: a list of blocks, each a list of lines, without comments."""
    found, block = defaultdict(list), []
    for line in text.splitlines():
        if line.startswith("*"):
            block = []
            found[line[1:]].append(block)
        elif not line.startswith("$"):
            assert "," not in line, f"a comma says that columns are free: {line}"
            block.append(line)
    return found


def cells(line, width=10):
    """Numbers of a line of fields of ``width`` columns, or of a list of widths; blanks are None."""
    widths = width if isinstance(width, list) else [width] * (-(-len(line) // width))
    found, at = [], 0
    for one in widths:
        text = line[at : at + one].strip()
        found.append(None if not text else float(text))
        at += one
    return found


def curves_of(cards):
    """Abscissae and ordinates of each curve by number."""
    return {
        int(cells(block[1])[0]): tuple(zip(*(cells(line, [20, 20]) for line in block[2:]), strict=True))
        for block in cards["DEFINE_CURVE_TITLE"]
    }


def deck_text(kind, direction=None, sets=(), **chosen):
    """Run, prepared specimen and text of its deck; the specimen is clamped by it."""
    (run,) = resolve_test_runs(kind, direction, {"config": None, "sets": tuple(sets), **chosen})
    prepared = prepare(run)
    mass = prepared.model.mass.copy()
    return run, prepared, mass, deck_of(run, prepared)[0].text()
