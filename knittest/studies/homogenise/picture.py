"""homogenise.png: curves of yarns, and of shells with the card that was made of them."""

from pathlib import Path
from typing import TYPE_CHECKING

from knittest.base.figure import BLUE, ORANGE, dress, new_figure, save
from knittest.base.stamp import Stamp, stamped
from knittest.config.sources import numbers_of
from knittest.laboratory.run_stamp import size_of
from knittest.studies.homogenise.check import ANGLES
from knittest.studies.homogenise.measures import Tested, bending_stiffness, normalised, pulled
from knittest.studies.homogenise.outcome import Outcome
from knittest.studies.homogenise.plan import Piece

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Pairs = dict[Piece, tuple[Tested, Tested]]


def homogenise_picture(outcome: Outcome, pairs: Pairs, path: Path) -> None:
    """Force over strain, over shear angle, and bending stiffnesses; ``pairs`` are yarns and shells of each test.

    Raises :class:`ResourceError`.
    """
    figure = new_figure(11.0, 7.2)
    panels = figure.subplots(2, 2).ravel()
    figure.subplots_adjust(left=0.08, right=0.97, bottom=0.08, top=0.86, wspace=0.22, hspace=0.42)
    curves = [piece for piece in pairs if piece.kind != "cantilever"]
    for axes, piece in zip(panels, curves, strict=False):
        _curves(axes, piece, *pairs[piece])
    _bent(panels[3], {piece: pair for piece, pair in pairs.items() if piece.kind == "cantilever"})
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
    tensile = piece.kind == "tensile"
    styles = (("yarns", BLUE, "-", 2.4), ("shells with the card", ORANGE, "--", 1.6))
    for test, (label, colour, dash, thick) in zip((yarns, shells), styles, strict=True):
        axes.plot(*(pulled if tensile else normalised)(test), dash, color=colour, linewidth=thick, label=label)
    axes.set_xlim(left=0.0)
    axes.set_ylim(bottom=0.0)
    if tensile:
        axes.set(xlabel="strain [%]", ylabel="force per width [N/mm]")
        axes.set_title(f"tension, {piece.direction}, up to the largest force", loc="left", fontsize=10.5)
    else:
        axes.set_xticks([0.0, *ANGLES])
        axes.set(xlabel="shear angle [deg]", ylabel="normalised force [N/mm]")
        axes.set_title("shear", loc="left", fontsize=10.5)


def _bent(axes: "Axes", pairs: Pairs) -> None:
    """Bending stiffness by direction as a pair of bars."""
    dress(axes)
    axes.spines["right"].set_visible(False)
    axes.grid(False, axis="x")
    for k, (yarns, shells) in enumerate(pairs.values()):
        for test, shift, colour in ((yarns, -0.17, BLUE), (shells, 0.17, ORANGE)):
            stiffness = bending_stiffness(test)
            axes.bar(k + shift, stiffness, 0.3, color=colour)
            axes.annotate(f"{stiffness:.2f}", (k + shift, stiffness), (0, 3), textcoords="offset points", ha="center")
    axes.set_xticks(range(len(pairs)), [str(piece.direction) for piece in pairs])
    axes.margins(y=0.15)
    axes.set_ylabel("bending stiffness [N mm]")
    axes.set_title("bending", loc="left", fontsize=10.5)
