"""Runs the weave of Cao et al. (2008) in the frames of three laboratories, one cycle, and two seeds of a knit.

python benchmarks/picture_frame.py FOLDER [PRESET] runs what is missing in FOLDER, writes docs/picture-frame.png and the
tables in docs/picture-frame.md between its marks. Some five minutes with preset standard.
"""

import json
import sys
from pathlib import Path

import numpy as np
import pandas as pd

from knittest.base.figure import BLUE, GREEN, GREY, ORANGE, RED, new_figure, save, style_axes
from knittest.base.files import data_dir
from knittest.cli.main import run
from knittest.experiment.curves import load_curve

DOCS = Path(__file__).parents[1] / "docs"
BEGIN, END = "<!-- begin: benchmarks/picture_frame.py -->", "<!-- end -->"
#: laboratory, its file, frame side and fabric side [mm]
LABS = (("UML", "uml", 216, 140), ("UT", "ut", 250, 180), ("KUL, first cycle", "kul1", 250, 180))
ANGLES = ("5", "10", "20", "30", "40")
X, Y = "frame_shear_angle_deg", "normalised_shear_force_n_per_mm"
COLOURS = (ORANGE, GREEN, RED)


def commands() -> dict[str, list[str]]:
    """Options of every run by the name of its folder."""
    weave = ["picture-frame", "--variant", "cao2008-weave", "--scale", "macro", "--set", "solver.safety=0.6"]
    against = [part for _, file, _, _ in LABS for part in ("--against", f"cao2008/curves/{file}.csv")]
    runs = {
        file: [*weave, "--set", f"rig.side={fabric}", "--set", f"rig.frame_side={frame}", *against]
        for _, file, frame, fabric in LABS[:2]
    }
    runs["cycle"] = [
        *weave,
        "--set",
        "rig.side=140",
        "--set",
        "rig.frame_side=216",
        "--set",
        "rig.reversal_angles=[30, 0]",
    ]
    runs["seeds"] = ["picture-frame", "--variant", "1", "--scale", "macro", "--specimens", "2"]
    return runs


def comparison(folder: Path) -> list[str]:
    """Rows: laboratory's own curve and the model in its frame at each angle."""
    rows = [
        "| laboratory | frame / fabric [mm] | kind | " + " | ".join(f"{a}°" for a in ANGLES) + " | rmse | rating |",
        "|---|---|---|" + "---|" * (len(ANGLES) + 2),
    ]
    for name, file, frame, fabric in LABS:
        model = "ut" if file == "kul1" else file
        curves = json.loads((folder / model / "comparison.json").read_text())["curves"]
        found = next(c for c in curves if c["judged_against"].endswith(name))
        at = found[f"{Y}_at_deg"]
        cells = [
            f"{at[a]['reference']:.3f} / {at[a]['simulated']:.3f} ({at[a]['error_pct']:+.0f} %)" if a in at else "-"
            for a in ANGLES
        ]
        kind = "input" if found["reference_kind"] == "input" else "predicted"
        rating = found["rating"]
        rated = f"{rating['overall']:.2f} ({rating['grade']})" if rating else "-"
        rows.append(
            f"| {name} | {frame} / {fabric} | {kind} | {' | '.join(cells)} "
            f"| {found['rmse_pct_of_peak']:.1f} % | {rated} |"
        )
    return rows


def loop(folder: Path) -> str:
    """Work that the cycle 0 - 30 - 0 deg took, and what was booked, in a sentence."""
    curve, energies = (pd.read_csv(folder / "cycle" / f"{name}.csv") for name in ("curve", "energies"))
    angle = curve[X].to_numpy()
    top = int(np.argmax(angle > 29.99))
    back = top + int(np.argmin(angle[top : int(np.argmax(angle))]))
    work = float(np.trapezoid(curve["shear_force_n"][:back], curve["displacement_mm"][:back]))
    up = float(np.trapezoid(curve["shear_force_n"][:top], curve["displacement_mm"][:top]))
    booked = float(np.interp(curve["time_ms"][back], energies["time_ms"], energies["friction_mj"]))
    error = 100.0 * float(energies["energy_error"].iloc[len(energies) // 20 :].max())
    return (
        f"Cycle 0 - 30 - 0°: work of loading {up:.1f} mJ; hysteresis loss {work:.1f} mJ; friction in the shell "
        f"elements {booked:.1f} mJ; energy error at most {error:.2f} %."
    )


def seeds(folder: Path) -> list[str]:
    """Wrinkle results of both seeds side by side."""
    results = json.loads((folder / "seeds" / "summary.json").read_text())["results"]
    rows = ["| variant 1, wrinkles | seed 1 | seed 2 |", "|---|---|---|"]
    names = {"wrinkle_onset_deg": "onset [deg]", "wrinkle_amplitude_mm_at_40deg": "amplitude at 40° [mm]",
             "wrinkle_count_at_40deg": "number at 40°"}  # fmt: skip
    for key, label in names.items():
        one, two = (float("nan") if v is None else v for v in results[key]["values"])
        rows.append(f"| {label} | {one:.3g} | {two:.3g} |")
    return rows


def picture(folder: Path) -> None:
    """Left the laboratories and the model in both frames, right the cycle."""
    figure = new_figure(12.0, 5.4)
    axes, other = figure.add_axes((0.06, 0.11, 0.51, 0.8)), figure.add_axes((0.65, 0.11, 0.33, 0.8))
    curves = [load_curve(data_dir() / "cao2008" / "curves" / f"{file}.csv") for _, file, _, _ in LABS]
    x = np.linspace(0.5, 34.0, 200)
    between = np.array([np.interp(x, c.x, c.mean) for c in curves])
    style_axes(axes)
    axes.fill_between(x, between.min(0), between.max(0), color=GREY, alpha=0.15, linewidth=0, label="laboratories")
    for (name, file, frame, fabric), curve, colour in zip(LABS, curves, COLOURS, strict=True):
        said = "input of the model" if file == "uml" else "digitised"
        axes.plot(curve.x, curve.mean, "--", color=colour, label=f"{name}, {frame}/{fabric} mm ({said})")
    for (_, file, frame, fabric), mark in zip(LABS[:2], ("o", "x"), strict=True):
        model = pd.read_csv(folder / file / "curve.csv")
        mean = model.groupby(model[X].round())[Y].mean()
        said = f"model, {frame}/{fabric} mm (means over 1°)"
        axes.plot(mean.index, mean, mark, color=BLUE, markersize=4, fillstyle="none", label=said)
    axes.set(xlabel="shear angle [deg]", ylabel=r"normalised force $F_s L_{frame} / L_{fabric}^2$ [N/mm]")
    axes.set_ylim(0.0, 0.3)
    axes.legend(frameon=False, fontsize=9)
    axes.set_title("Glass/PP plain weave (Cao et al. 2008)", loc="left", fontsize=12)
    style_axes(other)
    cycle = pd.read_csv(folder / "cycle" / "curve.csv")
    other.plot(cycle[X], cycle["shear_force_n"], color=BLUE, linewidth=1.0)
    other.set(xlabel="shear angle [deg]", ylabel="force of the crosshead [N]")
    other.set_title("0 - 30 - 0 - 45°, half of it friction (assumed)", loc="left", fontsize=12)
    save(figure, DOCS / "picture-frame.png")


def main(folder: Path, preset: str = "standard") -> None:
    for name, options in commands().items():
        if not (folder / name / "summary.json").is_file() and run(
            [*options, "--preset", preset, "--no-frames", "--out", str(folder / name)]
        ):
            raise SystemExit(f"{name} failed")
    picture(folder)
    page = DOCS / "picture-frame.md"
    before, _, rest = page.read_text().partition(BEGIN)
    body = [f"Preset {preset}.", "", *comparison(folder), "", loop(folder), "", *seeds(folder)]
    page.write_text(before + "\n".join([BEGIN, "", *body, "", END]) + rest.partition(END)[2])


if __name__ == "__main__":
    main(Path(sys.argv[1]), *sys.argv[2:])
