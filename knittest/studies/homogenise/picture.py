"""homogenise.png: curves of yarns, and of shells with the card that was made of them."""

from pathlib import Path
from typing import TYPE_CHECKING

from knittest.base.figure import BLUE, ORANGE, dress, new_figure, save
from knittest.base.stamp import Stamp, stamped
from knittest.config.sources import numbers_of
from knittest.laboratory.picture_frame.shear_law import FRAME_ANGLE, NORMALISED
from knittest.laboratory.run_stamp import size_of
from knittest.studies.homogenise.card import Tested
from knittest.studies.homogenise.check import ANGLES
from knittest.studies.homogenise.curves import read_columns, to_peak
from knittest.studies.homogenise.outcome import Outcome
from knittest.studies.homogenise.plan import Piece, overhang

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Pairs = dict[Piece, tuple[Tested, Tested]]


def homogenise_picture(outcome: Outcome, pairs: Pairs, path: Path) -> None:
    """Force over strain, over shear angle, and the chord angles; ``pairs`` are yarns and shells of each test.

    Raises :class:`ResourceError`.
    """
    figure = new_figure(11.0, 7.2)
    panels = figure.subplots(2, 2).ravel()
    figure.subplots_adjust(left=0.08, right=0.97, bottom=0.08, top=0.86, wspace=0.22, hspace=0.42)
    curves = [piece for piece in pairs if piece.kind != "cantilever"]
    for axes, piece in zip(panels, curves, strict=False):
        _curves(axes, piece, *pairs[piece])
    _chords(panels[3], {piece: pair for piece, pair in pairs.items() if piece.kind == "cantilever"})
    run, worst = outcome.run, outcome.worst
    said = f"; largest deviation {worst.deviation:+.1f} %" if worst else ""
    numbers = numbers_of(run.parameters)
    title = f"{run.fabric.name} ({numbers}), {run.model.preset}: shells with the card made of yarns{said}"
    figure.suptitle(title, x=0.08, y=0.975, ha="left", va="top", fontsize=12)
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, frameon=False, fontsize=9.5, loc="upper left", bbox_to_anchor=(0.07, 0.945), ncols=2)
    tested = [f"{piece.name}: {', '.join(size_of(yarns.run))}" for piece, (yarns, _) in pairs.items()]
    facts = (run.fabric.name, f"parameters {numbers}", f"preset {run.model.preset}", *tested)
    with stamped(Stamp(facts, f"yarns {outcome.status} by shells with the card", bad=not outcome.within)):
        save(figure, path)


def _curves(axes: "Axes", piece: Piece, yarns: Tested, shells: Tested) -> None:
    dress(axes)
    axes.spines["right"].set_visible(False)
    pulled = piece.kind == "tensile"
    columns = ("strain_pct", "force_n") if pulled else (FRAME_ANGLE, NORMALISED)
    styles = (("yarns", BLUE, "-", 2.4), ("shells with the card", ORANGE, "--", 1.6))
    for test, (label, colour, dash, thick) in zip((yarns, shells), styles, strict=True):
        x, y = read_columns(test.folder, *columns)
        if pulled:
            x, y = to_peak(x, y)
        axes.plot(x, y, dash, color=colour, linewidth=thick, label=label)
    axes.set_xlim(left=0.0)
    axes.set_ylim(bottom=0.0)
    if pulled:
        axes.set(xlabel="strain [%]", ylabel="force [N]")
        axes.set_title(f"tensile, {piece.direction}, up to the largest force", loc="left", fontsize=10.5)
    else:
        axes.set_xticks([0.0, *ANGLES])
        axes.set(xlabel="shear angle of the frame [deg]", ylabel="normalised force [N/mm]")
        axes.set_title("picture frame", loc="left", fontsize=10.5)


def _chords(axes: "Axes", pairs: Pairs) -> None:
    """Chord angle of each cantilever as a pair of bars."""
    dress(axes)
    axes.spines["right"].set_visible(False)
    axes.grid(False, axis="x")
    for k, (yarns, shells) in enumerate(pairs.values()):
        for test, shift, colour in ((yarns, -0.17, BLUE), (shells, 0.17, ORANGE)):
            angle = test.results["chord_angle_deg"]
            axes.bar(k + shift, angle, 0.3, color=colour)
            axes.annotate(f"{angle:.1f}", (k + shift, angle), (0, 3), textcoords="offset points", ha="center")
    names = [f"{piece.direction}, {overhang(yarns.run):g} mm" for piece, (yarns, _) in pairs.items()]
    axes.set_xticks(range(len(pairs)), names)
    axes.margins(y=0.15)
    axes.set_ylabel("chord angle [deg]")
    axes.set_title("cantilever, overhang", loc="left", fontsize=10.5)
