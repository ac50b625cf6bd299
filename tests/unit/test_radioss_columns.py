"""Columns of the cards of a starter file, by the formats in the reader of OpenRadioss (hm_cfg_files, version 2026)."""

from itertools import accumulate

import pytest
from deck_reader import BEAM, SHELL
from radioss_reader import starter_of

N, R, TITLE = 10, 20, [100]
#: widths of each card; the last one repeats. A negative width is blank
CARDS = {
    "BEGIN": [TITLE, [N, N], [R, R, R]],
    "TITLE": [TITLE],
    "NODE": [[N, R, R, R]],
    "PART": [TITLE, [N, N, N, R]],
    "SHELL": [[N] * 5],
    "BEAM": [[N] * 4],
    "SPRING": [[N] * 3],
    "FUNCT": [TITLE, [R, R]],
    "GRNOD/NODE": [TITLE, [N] * 10],
    "GRBEAM/BEAM": [TITLE, [N] * 10],
    "LINE/PART": [TITLE, [N] * 10],
    "LINE/GRBEAM": [TITLE, [N] * 10],
    "MAT/LAW1": [TITLE, [R], [R, R]],
    "MAT/LAW158": [TITLE, [R], [R] * 5, [R, -N, N], [N, -N, R], [N, -N, R], [N, -N, R], [N, N]],
    "FAIL/TENSSTRAIN": [[R, R, N, R, R, N], [N]],
    "PROP/TYPE3": [TITLE, [-N, N], [R, R], [R] * 4, [N, N]],
    "PROP/TYPE4": [TITLE, [R, -30, N, N, N], [R] * 5, [N, N, N, N, N, -N, R, R], [R] * 4],
    "PROP/TYPE16": [
        TITLE, [N, N, N, -30, R], [R] * 5, [N, N, R, R, -N, N], [R, R, R, N, N, -N, N], [R, R, R, R, N],
    ],
    "INTER/TYPE11": [TITLE, [N, N, N, N, N, -N, N, N], [R, R, R, R, N, N], [R] * 5, [N, -R, N, R, R, R], [-90, N]],
    "BCS": [TITLE, [N, N, N]],
    "IMPVEL": [TITLE, [N] * 7, [R] * 4],
    "DAMP": [TITLE, [R, R, N, N, R, R]],
    "GRAV": [TITLE, [N, N, N, N, N, -N, R, R]],
    "TH/NODE": [TITLE, [N] * 4, [N, N]],
}  # fmt: skip
#: number of cards of keywords with tables
TABLES = ("NODE", "SHELL", "BEAM", "SPRING", "FUNCT", "GRNOD/NODE", "GRBEAM/BEAM", "LINE/PART", "LINE/GRBEAM",
          "TH/NODE", "PROP/TYPE16", "BEGIN")  # fmt: skip
#: codes of degrees of freedom: blank columns are part of them
CODES = {("PROP/TYPE3", 4): "   000 000", ("INTER/TYPE11", 4): "       000"}


@pytest.fixture(scope="module")
def decks():
    strip = starter_of("tensile", "weft", ["rig.width=12", "rig.gauge_length=12"], **BEAM)[3]
    frame = starter_of("picture-frame", sets=["rig.side=60", "model.macro.element_size=6"], **SHELL)[3]
    return {name: [*strip.get(name, {}).values(), *frame.get(name, {}).values()] for name in {**strip, **frame}}


def test_each_keyword_is_known(decks):
    assert set(decks) == set(CARDS)


@pytest.mark.parametrize("name", CARDS)
def test_each_card_fills_its_columns(decks, name):
    formats = CARDS[name]
    for lines in decks[name]:
        assert len(lines) >= len(formats) and (name in TABLES or len(lines) == len(formats)), (name, lines)
        for number, line in enumerate(lines):
            widths = formats[min(number, len(formats) - 1)]
            if widths != TITLE:
                _check(line, widths, CODES.get((name, number)))


def _check(line, widths, code):
    """Fields are right-justified, names of variables and codes apart; the next begins right behind."""
    assert len(line) in list(accumulate(map(abs, widths))), line
    at = 0
    for width in widths:
        field = line[at : at + abs(width)]
        at += abs(width)
        if code is not None and at == abs(width):
            assert field == code
        elif width < 0:
            assert not field.strip(), (line, field)
        elif field and field.strip() and not field.strip().isalpha() and "REAC" not in field and "D" not in field:
            assert " " not in field.strip() or field.strip().replace(" ", "").isdigit(), (line, field)
            assert field[-1] != " ", (line, field)
