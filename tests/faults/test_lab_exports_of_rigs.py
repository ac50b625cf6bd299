"""Files of the other tests as machines write them: units, languages, rows that are no specimens, other columns."""

import re

import numpy as np
import pytest
from machine_exports import lines, text, workbook
from strip_reading import refused

from knittest.experiment.lab_tests import LAB_TESTS, read_files
from knittest.materials.trellis import crosshead, crosshead_of_normalised

GAMMA = np.deg2rad(np.linspace(0.0, 45.0, 91))
WAY = np.array([crosshead(gamma, 200.0) for gamma in GAMMA])
FRAME = crosshead_of_normalised(0.1 * GAMMA / np.cos(GAMMA), GAMMA, 180.0, 200.0)
TIME = 0.5 * np.arange(len(GAMMA))
FRAME_HEAD = [["Frame side", "200", "mm"], ["Fabric side", "180", "mm"]]
KPA = np.geomspace(0.5, 500.0, 40)
THICK = 3.0 - 0.2 * np.log10(KPA)
PLATE = np.pi * 25.0**2 * 1e-3  # N per kPa of a plate of 50 mm
PULL = np.linspace(0.0, 50.0, 201)
MU = np.where(PULL < 2.0, 0.06 * PULL, 0.1)
PLATES = [["Normal force", "2000", "N"], ["Plate length", "150", "mm"], ["Plate width", "50", "mm"]]
WAYS = np.linspace(0.0, 30.0, 100)
BIAS = 5.0 * (WAYS / 30.0) ** 2
BIAS_HEAD = [["Specimen width", "100", "mm"], ["Gauge length", "200", "mm"]]
STRIPS = {"area_mass": 830.0, "width": 25.0}


def overhangs(name, *labels):
    rows = [["", name], ["1", "165"], ["2", "163"], ["3", "170"], *([label, "166"] for label in labels)]
    return text([["Nr", name], *rows[1:]])


# fmt: off
#: test, what is special: file, options
FILES = {
    ("picture-frame", "stroke"): (lambda: text(lines(
        ["Time", "Stroke", "Force"], (TIME, WAY, FRAME), ["s", "mm", "N"], FRAME_HEAD)), {}),
    ("picture-frame", "force before stroke"): (lambda: text(lines(
        ["Time", "Force", "Stroke"], (TIME, FRAME, WAY), ["s", "N", "mm"], FRAME_HEAD)), {}),
    ("picture-frame", "two frames"): (lambda: text(lines(
        ["Time", "Force", "Displacement"] * 2, (TIME, FRAME, WAY, TIME, FRAME * 1.0001, WAY), ["s", "N", "mm"] * 2,
        FRAME_HEAD)), {}),
    ("picture-frame", "polish angle"): (lambda: text(lines(
        ["Kąt ścinania [°]", "Siła [N]"], (np.rad2deg(GAMMA), FRAME),
        head=[["Bok ramy", "200", "mm"], ["Bok tkaniny", "180", "mm"]]), ";", ",", "cp1250"), {}),
    ("picture-frame", "workbook"): (lambda: workbook({
        "Parameter": [["Rahmenlänge", "200", "mm"], ["Gewebeseite", "180", "mm"]],
        "Werte": lines(["Weg", "Kraft"], (WAY, FRAME), ["mm", "N"], [])}), {}),
    ("picture-frame", "no header"): (lambda: text(lines([], (TIME, WAY, FRAME), head=[])[1:]),
        {"columns": "time,travel,force", "frame_side": 200.0, "fabric_side": 180.0}),
    ("compaction", "bar"): (lambda: text(lines(["Thickness [mm]", "Pressure [bar]"], (THICK, KPA / 100.0), head=[])),
        {}),
    ("compaction", "psi"): (lambda: text(lines(["Gap [in]", "Pressure [psi]"], (THICK / 25.4, KPA / 6.894757),
        head=[])), {}),
    ("compaction", "force and plate"): (lambda: text(lines(["Dicke [mm]", "Kraft [N]"], (THICK, KPA * PLATE),
        head=[["Plattendurchmesser", "5", "cm"]])), {}),
    ("compaction", "force and option"): (lambda: text(lines(["Épaisseur (mm)", "Force (N)"], (THICK, KPA * PLATE),
        head=[]), ";", ",", "cp1252"), {"plate_diameter": 50.0}),
    ("friction", "coefficient"): (lambda: text(lines(["Travel [mm]", "Coefficient of friction"], (PULL, 2.0 * MU),
        head=PLATES)), {}),
    ("friction", "reibzahl"): (lambda: text(lines(["Weg [mm]", "Reibzahl"], (PULL, 2.0 * MU),
        head=[["Normalkraft", "2", "kN"], ["Plattenlänge", "150", "mm"], ["Plattenbreite", "50", "mm"]]),
        ";", ","), {}),
    ("friction", "normal force in a column"): (lambda: text(lines(
        ["Travel [mm]", "Normal force [N]", "Friction force [N]"], (PULL, 0.0 * PULL + 2000.0, 4000.0 * MU),
        head=PLATES[1:])), {}),
    ("bias-extension", "strain"): (lambda: text(lines(["Strain [%]", "Load [N]"], (WAYS / 2.0, BIAS), head=BIAS_HEAD)),
        {}),
    ("bias-extension", "chinese strain"): (lambda: text(lines(["应变(mm/mm)", "载荷(N)"], (WAYS / 200.0, BIAS),
        head=[["试样宽度", "100", "mm"], ["夹持距离", "200", "mm"]]), encoding="gb18030"), {}),
    ("cantilever", "english"): (lambda: overhangs("Overhang [mm]", "Mean", "CV [%]", "Std. Dev.", "n"), STRIPS),
    ("cantilever", "german"): (lambda: overhangs("Überhang [mm]", "Mittelwert", "Max", "Min", "Spannweite"), STRIPS),
    ("cantilever", "french"): (lambda: overhangs("Porte-à-faux [mm]", "Moyenne", "Écart-type"), STRIPS),
    ("cantilever", "polish"): (lambda: overhangs("Zwis [mm]", "Średnia", "Odchylenie standardowe"), STRIPS),
    ("cantilever", "chinese"): (lambda: overhangs("悬垂长度 [mm]", "平均值", "标准差", "变异系数"), STRIPS),
    ("cantilever", "japanese"): (lambda: overhangs("張り出し長さ [mm]", "平均", "標準偏差"), STRIPS),
    ("cantilever", "spanish"): (lambda: overhangs("Voladizo [mm]", "Media", "Desviación estándar"), STRIPS),
    ("cantilever", "italian"): (lambda: overhangs("Sbalzo [mm]", "Media", "Deviazione standard"), STRIPS),
    ("cantilever", "faces in columns"): (lambda: text([["Specimen", "Overhang A [mm]", "Overhang B [mm]"],
        ["1", "160", "170"], ["2", "163", "163"], ["3", "175", "165"]]), STRIPS),
    ("cantilever", "workbook"): (lambda: workbook({"S": [["Specimen", "Overhang [mm]"], ["1", "165"], ["2", "163"],
        ["3", "170"], ["Mean", "166"], ["SD", "3.6"]]}), STRIPS),
}
# fmt: on
#: column of the result, and its values
EXPECTED = {
    "picture-frame": ("10 deg [N]", float(np.interp(np.deg2rad(10.0), GAMMA, FRAME)), 3e-3),
    "compaction": ("100 kPa [mm]", 2.6, 1e-3),
    "friction": ("of a face", 0.1, 1e-3),
    "cantilever": ("overhang [mm]", [165.0, 163.0, 170.0], 1e-9),
}


def shown(test, path, options):
    """Columns of the table that is printed, by their heads."""
    table = LAB_TESTS[test].lines(read_files(test, [path], options))
    heads, *rows = (re.split(r"\s{2,}", line.strip()) for line in table)
    values = [row[1:] for row in rows[: next(k for k, row in enumerate(rows) if row[0] == "mean")]]
    return dict(zip(heads[1:], np.array(values, float).T, strict=True))


@pytest.mark.parametrize(("test", "kind"), FILES)
def test_the_result_is_right(tmp_path, test, kind):
    export, options = FILES[test, kind]
    found = shown(test, export().written(tmp_path), options)
    if test == "bias-extension":  # as of the same test with an extension in mm
        same = text(lines(["Extension [mm]", "Load [N]"], (WAYS, BIAS), head=BIAS_HEAD), name="same.csv")
        assert found["20 deg [N]"] == pytest.approx(shown(test, same.written(tmp_path), {})["20 deg [N]"], rel=1e-4)
        return
    head, value, tolerance = EXPECTED[test]
    assert np.shape(found[head]) == np.shape(value) or not np.shape(value)
    assert found[head] == pytest.approx(np.broadcast_to(value, np.shape(found[head])), rel=tolerance)


def test_columns_that_name_no_overhang_are_listed_with_the_option(tmp_path):
    rows = [["Specimen", "A face up [mm]"], ["1", "165"], ["2", "163"]]
    path = text(rows).written(tmp_path)
    refused(r'--column overhang="A face up \[mm\]"', read_files, "cantilever", [path], STRIPS)
    strips = read_files("cantilever", [path], STRIPS | {"column": ('overhang="A face up [mm]"',)})
    assert [strip.overhang for strip in strips] == [165.0, 163.0]


def test_a_force_on_a_plate_of_unknown_size_is_no_pressure(tmp_path):
    path = text(lines(["Thickness [mm]", "Force [N]"], (THICK, KPA), head=[])).written(tmp_path)
    refused(r"states no plate diameter: give --plate-diameter \[mm\]", read_files, "compaction", [path], {})
