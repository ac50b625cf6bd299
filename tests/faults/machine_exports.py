"""Small exports as testing machines write them: a strip of 50 mm, 200 mm between the clamps, 7,000 N at 1.6 %."""

import io
import zipfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.sax.saxutils import escape

import numpy as np

PEAK, STRAIN, GAUGE = 7000.0, 1.6, 200.0
ROWS = 41
SHARE = np.append(np.linspace(0.0, 1.0, ROWS), [1.02, 1.04, 1.06])
E = STRAIN * SHARE
F = PEAK * np.append(SHARE[:ROWS] ** 1.5, [0.5, 0.2, 0.05])
TRAVEL = E / 100.0 * GAUGE
TIME = 0.5 * np.arange(len(E))
SIZES = {"width": 50.0, "gauge_length": GAUGE}
HEAD = [["Specimen width", "50", "mm"], ["Grip separation", "200", "mm"]]


@dataclass(frozen=True)
class Export:
    """A file ``name``, its ``raw`` bytes, and the options that a user gives."""

    raw: bytes
    name: str = "warp-1.csv"
    said: dict | None = None

    def written(self, folder: Path) -> Path:
        path = folder / self.name
        path.write_bytes(self.raw)
        return path


def lines(names: Sequence[str], columns: Sequence[np.ndarray], units: Sequence[str] = (), head=HEAD) -> list[list[str]]:
    """Rows of text: the head, the names, their units, the numbers."""
    rows = [[f"{v:.6g}" for v in row] for row in np.column_stack(columns)]
    return [*head, list(names), *([list(units)] if units else []), *rows]


def text(rows, mark=";", decimal=".", encoding="utf-8", **more) -> Export:
    def cell(value):
        return value.replace(".", decimal) if value.replace(".", "").replace("-", "").isdigit() else value

    body = "\r\n".join(mark.join(map(cell, row)) for row in rows) + "\r\n"
    return Export(body.encode(encoding), **more)


def aligned(rows, **more) -> Export:
    return Export("\n".join("".join(f"{cell:>16}" for cell in row) for row in rows).encode(), **more)


def workbook(sheets: dict[str, list[list[str]]], **more) -> Export:
    """A minimal xlsx: numbers as such, texts inline."""
    made = io.BytesIO()
    relations = "http://schemas.openxmlformats.org/officeDocument/2006/relationships"
    main = "http://schemas.openxmlformats.org/spreadsheetml/2006/main"
    package = "http://schemas.openxmlformats.org/package/2006/"
    with zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED) as archive:
        kinds = [("workbook", "sheet.main")] + [
            (f"worksheets/sheet{k}", "worksheet") for k in range(1, len(sheets) + 1)
        ]
        parts = "".join(
            f'<Override PartName="/xl/{name}.xml" ContentType="application/vnd.openxmlformats-officedocument.'
            f'spreadsheetml.{kind}+xml"/>' for name, kind in kinds
        )  # fmt: skip
        archive.writestr("[Content_Types].xml", f'<Types xmlns="{package}content-types">{parts}</Types>')
        link = f'<Relationship Id="r1" Type="{relations}/officeDocument" Target="xl/workbook.xml"/>'
        archive.writestr("_rels/.rels", f'<Relationships xmlns="{package}relationships">{link}</Relationships>')
        names = "".join(f'<sheet name="{n}" sheetId="{k}" r:id="r{k}"/>' for k, n in enumerate(sheets, 1))
        book = f'<workbook xmlns="{main}" xmlns:r="{relations}"><sheets>{names}</sheets></workbook>'
        archive.writestr("xl/workbook.xml", book)
        links = "".join(
            f'<Relationship Id="r{k}" Type="{relations}/worksheet" Target="worksheets/sheet{k}.xml"/>'
            for k in range(1, len(sheets) + 1)
        )
        links = f'<Relationships xmlns="{package}relationships">{links}</Relationships>'
        archive.writestr("xl/_rels/workbook.xml.rels", links)
        for k, rows in enumerate(sheets.values(), 1):
            body = "".join(f"<row>{''.join(map(_cell, row))}</row>" for row in rows)
            sheet = f'<worksheet xmlns="{main}"><sheetData>{body}</sheetData></worksheet>'
            archive.writestr(f"xl/worksheets/sheet{k}.xml", sheet)
    return Export(made.getvalue(), **({"name": "warp-1.xlsx"} | more))


def _cell(value: str) -> str:
    try:
        float(value)
    except ValueError:
        return f'<c t="inlineStr"><is><t>{escape(value)}</t></is></c>'
    return f"<c><v>{value}</v></c>"


def slipped(strain: np.ndarray) -> np.ndarray:
    """A strain that falls from 80 % of the way on, as of an extensometer that slips."""
    return np.where(SHARE < 0.8, strain, 0.5 * strain)


def taken_off(strain: np.ndarray) -> np.ndarray:
    """A strain that jumps below zero from half the way on."""
    return np.where(SHARE < 0.5, strain, -3.0)


def at_rest(values: np.ndarray, rows: int, noise: float = 0.0) -> np.ndarray:
    """``values`` with ``rows`` of the first before them, and alternating noise."""
    padded = np.append(np.full(rows, values[0]), values)
    return padded + noise * np.where(np.arange(len(padded)) % 2, 1.0, -1.0)


T, B = (TIME, F, TRAVEL), (F, TRAVEL)
STATISTICS_BELOW = [["", ""], ["Mean", "7000"], ["Standard deviation", "12.1"], ["Coefficient of variation", "0.2"]]

# fmt: off
#: exports that are read right, by what is special in them
RIGHT: dict[str, Callable[[], Export]] = {
    "german, tabs, utf-16 without mark": lambda: text(
        lines(["Prüfzeit", "Kraft", "Standardweg"], T, ["s", "N", "mm"], [["Probenbreite b0", "50", "mm"],
        ["Einspannlänge", "200", "mm"]]), "\t", ",", "utf-16-le", name="Kette 1.TXT",
    ),
    "english, utf-16 big-endian without mark": lambda: text(
        lines(["Time (s)", "Load (N)", "Extension (mm)"], T), ",", encoding="utf-16-be"
    ),
    "french, windows-1252, strain before travel": lambda: text(
        lines(["Temps (s)", "Charge (kN)", "Déplacement (mm)", "Déformation (%)"], (TIME, F / 1e3, 1.3 * TRAVEL, E),
        head=[["Largeur de l'éprouvette", "50", "mm"], ["Distance entre mors", "200", "mm"]]), ";", ",", "cp1252",
    ),
    "polish, windows-1250": lambda: text(
        lines(["Czas", "Siła", "Przemieszczenie"], T, ["[s]", "[N]", "[mm]"], [["Szerokość próbki", "50", "mm"],
        ["Odległość między uchwytami", "200", "mm"]]), ";", ",", "cp1250", name="osnowa 1.csv",
    ),
    "chinese, gb18030": lambda: text(
        lines(["时间", "力", "位移"], T, ["s", "N", "mm"], [["试样宽度", "50", "mm"], ["夹持距离", "200", "mm"]]),
        ",", encoding="gb18030", name="经向-1.csv",
    ),
    "japanese, shift-jis": lambda: text(
        lines(["時間", "試験力", "ストローク"], T, ["sec", "N", "mm"], [["試験片幅", "50", "mm"],
        ["つかみ具間距離", "200", "mm"]]), ",", encoding="cp932",
    ),
    "spanish": lambda: text(
        lines(["Tiempo", "Fuerza", "Desplazamiento"], T, ["s", "N", "mm"], [["Ancho de la probeta", "50", "mm"],
        ["Distancia entre mordazas", "200", "mm"]]), ";", ",", "cp1252",
    ),
    "italian": lambda: text(
        lines(["Tempo [s]", "Forza [N]", "Spostamento [mm]"], T, head=[["Larghezza provino", "50", "mm"],
        ["Distanza tra le ganasce", "200", "mm"]]), "\t", ",",
    ),
    "columns aligned by blanks": lambda: aligned(
        lines(["Time", "Load", "Extension"], T, ["(s)", "(N)", "(mm)"], []), said=SIZES, name="warp-1.txt"
    ),
    "prefixes of channels": lambda: text(
        lines(["C_1_Temps[s]", "C_1_Force[kN]", "C_1_Déplacement[mm]"], (TIME, F / 1e3, TRAVEL), head=[]), "\t",
        encoding="cp1252", said=SIZES,
    ),
    "inches and pounds": lambda: text(
        lines(["Load [lbf]", "Stroke [in.]"], (F / 4.4482216152605, TRAVEL / 25.4), head=[]), ",", said=SIZES
    ),
    "strain in in./in.": lambda: text(
        lines(["Load (lbf)", "Strain (in./in.)"], (F / 4.4482216152605, E / 100.0), head=[]), ",", said=SIZES
    ),
    "other columns of stress and rates": lambda: text(
        lines(["Time [s]", "Load [N]", "Extension [mm]", "Tensile stress [MPa]", "Elastic modulus [MPa]",
        "Strain rate [%/s]", "Crosshead speed [mm/min]"], (*T, F / 25.0, F, E, TIME)), ",",
    ),
    "a result beside the recording": lambda: text(
        lines(["Extension (mm)", "Load (N)", "Extension at break (mm)"], (TRAVEL, F, 0.0 * F + 3.3)), ","
    ),
    "travel that begins at 10 mm": lambda: text(lines(["Force [N]", "Displacement [mm]"], (F, TRAVEL + 10.0)), ","),
    "travel that begins at -1.2 mm": lambda: text(lines(["Force [N]", "Displacement [mm]"], (F, TRAVEL - 1.2)), ","),
    "absolute position, falling": lambda: text(
        lines(["Force [N]", "Crosshead position [mm]"], (F, 412.0 - TRAVEL)), ","
    ),
    "rows at rest, 3,000 of them": lambda: text(
        lines(["Time", "Force [N]", "Travel [mm]"], [at_rest(c, 3000) for c in T]), ","
    ),
    "rows at rest with noise": lambda: text(
        lines(["Force [N]", "Travel [mm]"], (at_rest(F, 40, 2.0), at_rest(TRAVEL, 40, 2e-3))), ","
    ),
    "rows that repeat a travel": lambda: text(
        lines(["Force [N]", "Travel [mm]"], (np.repeat(F, 2), np.repeat(TRAVEL, 2))), ","
    ),
    "noise in the travel": lambda: text(
        lines(["Force [N]", "Travel [mm]"], (np.repeat(F, 4), at_rest(np.repeat(TRAVEL, 4), 0, 4e-3))), ","
    ),
    "words that deny another test": lambda: text(
        [["Load cell", "Tension/compression 10 kN"], ["Cyclic test", "no"], ["Method", "Zug-/Druckprüfung"],
        *lines(["Force [N]", "Travel [mm]"], B)], ",",
    ),
    "return stroke": lambda: text(
        lines(["Force [N]", "Travel [mm]"], (np.append(F, np.zeros(20)), np.append(TRAVEL, np.linspace(3.3, 0.0, 20)))),
        ",",
    ),
    "not a number in a cell": lambda: text(
        [row if k != 9 else [row[0], "NaN"] for k, row in enumerate(lines(["Force [N]", "Travel [mm]"], B))], ","
    ),
    "empty cells": lambda: text(
        [row if k != 9 else ["", row[1]] for k, row in enumerate(lines(["Force [N]", "Travel [mm]"], B))], ","
    ),
    "statistics below": lambda: text([*lines(["Force [N]", "Travel [mm]"], B), *STATISTICS_BELOW], ","),
    "results with statistics above": lambda: text(
        [["Specimen", "Maximum load", "Strain at break"], ["", "(N)", "(%)"], ["1", "7000", "1.7"],
        ["Mean", "7000", "1.7"], ["Maximum", "7000", "1.7"], [""],
        *lines(["Time (s)", "Load (N)", "Extension (mm)"], T)], ",",
    ),
    "blocks of one recording": lambda: text(
        [*HEAD, *(row for k in range(4) for row in [["Data Acquisition: Timed"],
        *lines(["Force [N]", "Travel [mm]"], (F[k * 11:k * 11 + 11], TRAVEL[k * 11:k * 11 + 11]), head=[])])], ",",
    ),
    "extensometer with a gauge length of its own": lambda: text(
        lines(["Force", "Extensometer", "Crosshead"], (F, E, 1.3 * TRAVEL), ["N", "mm", "mm"],
        [*HEAD, ["Gauge length of the extensometer", "100", "mm"]]), ",",
    ),
    "grip separation and gauge length": lambda: text(
        lines(["Force [N]", "Extensometer [mm]"], (F, E), head=[*HEAD, ["Gauge length", "100", "mm"]]), ","
    ),
    "extensometer at the end of its range": lambda: text(
        lines(["Force [N]", "Travel [mm]", "Strain 1 [%]"], (F, TRAVEL, np.minimum(E, 1.0))), ","
    ),
    "slack of the clamp beside a strain": lambda: text(
        lines(["Force [N]", "Travel [mm]", "Strain 1 [%]"], (F, np.append(0.0, TRAVEL[1:] + 3.0), E)), ","
    ),
    "extensometer taken off": lambda: text(
        lines(["Force [N]", "Travel [mm]", "Strain 1 [%]"], (F, TRAVEL, taken_off(E))), ","
    ),
    "extensometer slipped": lambda: text(
        lines(["Force [N]", "Travel [mm]", "Extensometer [mm]"], (F, TRAVEL, slipped(E)),
        head=[*HEAD, ["Extensometer gauge length", "100", "mm"]]), ",",
    ),
    "workbook, sheets of results and of values": lambda: workbook({
        "Results": [["Specimen", "b0", "L0", "Fmax"], ["", "mm", "mm", "N"], ["1", "50", "200", "7000"]],
        "Specimen 1": [["Specimen 1"], *lines(["Time", "Standard force", "Standard travel"], T, ["s", "N", "mm"], [])],
    }),
    "french workbook": lambda: workbook({
        "Résultats": [["Largeur de l'éprouvette", "Distance entre mors"], ["mm", "mm"], ["50", "200"]],
        "Valeurs": lines(["Temps", "Force", "Déplacement"], T, ["s", "N", "mm"], []),
    }, name="chaîne-1.xlsx"),
    "no header, with --columns": lambda: text(
        lines([], (TIME, TRAVEL, F), head=[])[1:], ",", said=SIZES | {"columns": "time,travel,force"}
    ),
    "a name that nobody foresaw": lambda: text(
        lines(["Kanal A", "Kanal B"], B), ";", ",", said=SIZES | {"column": ("force=Kanal A", "travel=Kanal B")}
    ),
}
# fmt: on


def headed(*head, names=("Force [N]", "Displacement [mm]"), columns=B):
    return lambda: text(lines(list(names), columns, head=[*HEAD, *map(list, head)]), ";")


# fmt: off
#: exports of what is no pull, or that leave something open, with what their message says
REJECTED: dict[str, tuple[Callable[[], Export], str]] = {
    "flexure by its column": (
        headed(("Support span", "64", "mm"), names=("Flexure extension [mm]", "Flexure load [N]"), columns=B[::-1]),
        "flexure",
    ),
    "flexure by its title, german": (headed(("Prüfvorschrift", "3-Punkt-Biegeversuch")), "flexure"),
    "flexure by its column, french": (
        headed(names=("Force [N]", "Déplacement [mm]", "Contrainte de flexion [MPa]"), columns=(*B, F)),
        "flexure",
    ),
    "compression": (headed(("Test type", "Compression")), "compression"),
    "compression, chinese": (headed(("试验类型", "压缩试验")), "compression"),
    "compression, by its columns, german": (headed(names=("Druckkraft [N]", "Stauchweg [mm]")), "compression"),
    "tear": (headed(("Test method", "ISO 13937-2 tear")), "tear"),
    "tear, german": (headed(("Weiterreißversuch",)), "tear"),
    "peel": (headed(("T-peel test",)), "peel"),
    "peel, polish": (headed(("Rodzaj badania", "Próba odrywania")), "peel"),
    "cyclic": (headed(("Test", "Cyclic tensile test, 10 cycles")), "cyclic"),
    "cyclic, french": (headed(("Essai", "Traction cyclique")), "cyclic"),
    "hysteresis, german": (headed(("Prüfung", "Zugversuch mit Hysterese")), "cyclic"),
    "cyclic, japanese": (headed(("試験種類", "繰返し引張試験")), "cyclic"),
    "no header": (lambda: text(lines([], (TIME, TRAVEL, F), head=[])[1:], ","), "--columns time,travel,force"),
    "no header, two columns": (lambda: text(lines([], (TRAVEL, F), head=[])[1:], ","), "--columns travel,force"),
    "names that nobody foresaw": (lambda: text(lines(["Kanal A", "Kanal B"], B)), '--column force="Kanal A" --column'),
    "an extensometer alone, taken off": (
        lambda: text(lines(["Force [N]", "Strain [%]"], (F, taken_off(E)))),
        "its strain turns negative|its strain falls",
    ),
    "an extensometer alone, and the distance of the grips": (
        lambda: text(lines(["Force [N]", "Extensometer [mm]"], (F, E))), "add a row 'extensometer gauge length;...;mm'",
    ),
    "a strain in the wrong unit": (
        lambda: text(lines(["Force [N]", "Travel [mm]", "Strain [%]"], (F, TRAVEL, E / 100.0))),
        "% or a fraction",
    ),
    "a force per width": (lambda: text(lines(["Force per width [N/mm]", "Travel [mm]"], B)), "force"),
    "a stress and no force": (lambda: text(lines(["Stress [MPa]", "Travel [mm]"], B)), "stress"),
}
# fmt: on
