"""Files as testing machines write them: the right numbers, or the reason why not, for each kind of them."""

import random

import pytest
from machine_exports import PEAK, REJECTED, RIGHT, SIZES, STRAIN, B, Export, lines, text
from machine_workbook import XLS

from knittest.base.errors import InputError
from knittest.cli.main import run
from knittest.experiment.lab_tests import read_files
from knittest.experiment.statistics import peaks

RIGHT = {**RIGHT, "xls workbook": lambda: Export(XLS, "kette 1.xls")}
NOISY = {"rows at rest with noise": 0.02, "noise in the travel": 0.02}


@pytest.mark.parametrize("kind", RIGHT)
def test_maximum_force_and_strain_are_right(tmp_path, kind):
    export = RIGHT[kind]()
    specimens = read_files("tensile", [export.written(tmp_path)], export.said or {})
    force, strain = peaks(specimens)
    assert force == pytest.approx([PEAK], rel=1e-3)
    assert strain == pytest.approx([STRAIN], rel=NOISY.get(kind, 1e-3))
    assert specimens[0].width == 50.0


@pytest.mark.parametrize("kind", REJECTED)
def test_what_is_no_pull_is_rejected_with_its_name(tmp_path, kind):
    export, words = REJECTED[kind]
    path = export().written(tmp_path)
    with pytest.raises(InputError, match=words) as refused:
        peaks(read_files("tensile", [path], SIZES))
    assert str(refused.value).startswith(str(path))


def test_the_output_names_the_columns_that_count_and_why_others_do_not(tmp_path, capsys):
    path = RIGHT["extensometer slipped"]().written(tmp_path)
    assert run(["data", "import", str(path), "--direction", "warp", "--out", str(tmp_path / "mine")]) == 0
    said = capsys.readouterr().out
    assert "columns used: 'Force [N]' (force), 'Travel [mm]' (clamp travel, gauge length 200 mm)" in said
    assert (
        "columns not used: 'Extensometer [mm]' (extensometer travel, gauge length 100 mm: its strain falls from" in said
    )


def test_the_option_that_a_message_prints_reads_the_file(tmp_path, capsys):
    path = text(lines(["Kanal A", "Kanal B"], B), name="a.csv").written(tmp_path)
    assert run(["data", "stats", str(path)]) == 2
    assert '--column force="Kanal A" --column travel="Kanal B"' in capsys.readouterr().err
    assert run(["data", "stats", str(path), "--column", "force=Kanal A", "--column", "travel=Kanal B"]) == 0
    assert run(["data", "stats", str(path), "--column", "force=Kanal X"]) == 2
    assert "--column names 'kanal x', which the file does not have" in capsys.readouterr().err
    assert run(["data", "stats", str(path), "--column", "power=Kanal A"]) == 2
    assert "expected ROLE=NAME, ROLE one of" in capsys.readouterr().err


@pytest.mark.parametrize("seed", range(6))
def test_a_damaged_workbook_is_read_or_refused(tmp_path, seed):
    """The reader of workbooks may end its own process, or ask for any memory."""
    draw, raw = random.Random(seed), bytearray(XLS)
    for place in draw.sample(range(len(raw)), 40):
        raw[place] = draw.randrange(256)
    path = Export(bytes(raw[: 5000 if seed == 0 else None]), "a.xls").written(tmp_path)
    try:
        assert read_files("tensile", [path], {})
    except InputError as error:
        assert str(error).startswith(str(path))
