"""Numbers of a run that can be meant, but hardly are: what a warning says of them."""

from collections.abc import Iterator

from knittest.config.fabric import Fabric
from knittest.config.run import Run
from knittest.config.unread import unread_note, unused_notes

#: scale of the slack [%] below which it moves no result: a yarn of 200 mm is 0.04 mm longer
LEAST_SLACK = 0.02
#: what is said of a derived number whose simulation did not pass its quality checks
REJECTED = " is derived from a simulation that failed its quality checks: "
#: draw-in [%] below which it is lost in the scatter of any loop length
LEAST_DRAW_IN = 0.1
#: thickness of a fabric over that of two inlays and two loop yarns, beyond which one of them is another fabric's
THICKNESS = (0.7, 1.4)


def doubts(run: Run) -> list[str]:
    """Warnings of numbers that ``run`` does not read, that do not fit its yarns, or that look like fractions."""
    return [
        *filter(None, [unread_note(run)]), *unused_notes(run), *_unlike_the_yarns(run.fabric), *_as_fractions(run),
        *_rejected_card(run),
    ]  # fmt: skip


def _unlike_the_yarns(fabric: Fabric) -> Iterator[str]:
    """Thickness that the yarns hardly make; far beyond, it is an error."""
    if fabric.reinforcing is None or fabric.knitting is None:
        return
    inlays = sum(fabric.reinforcing.section_mm(direction)[1] for direction in ("warp", "weft"))
    made, stated = inlays + 2.0 * fabric.knitting.beam_diameter_mm, fabric.thickness
    low, high = (share * made for share in THICKNESS)
    if not low <= stated.value <= high:
        yield (
            f"fabric.thickness = {stated.value:g} mm ({stated.source}), but two inlays and two loop yarns make "
            f"{made:.3g} mm, expected {low:.3g} to {high:.3g} mm: correct it or beam_diameter of the yarns"
        )


def _rejected_card(run: Run) -> Iterator[str]:
    """Shear laws and bending stiffnesses of the shells that were derived from a simulation that was rejected."""
    macro = run.fabric.macro
    if run.model.scale == "meso" or macro.shear is None or macro.bending_stiffness is None:
        return
    bending = {f"bending_stiffness.{d}": macro.bending_stiffness.of(d).ref for d in ("warp", "weft")}
    for name, ref in {"shear": macro.shear.ref, **bending}.items():
        if REJECTED in ref:
            yield f"fabric.macro.{name}{REJECTED}{ref.partition(REJECTED)[2]}; give your own"


def _as_fractions(run: Run) -> Iterator[str]:
    """Slack and draw-in next to none, which are no error, as studies draw them from 0 on."""
    if run.model.scale == "macro":
        return
    slack, draw_in = run.fabric.reinforcing.slack, run.fabric.knitting.draw_in
    given = [(f"reinforcing.slack.{d}", slack.of(d).value, LEAST_SLACK) for d in ("warp", "weft")]
    given += [("knitting.draw_in", draw_in.value, LEAST_DRAW_IN)] if draw_in else []
    for name, value, least in given:
        if 0.0 < value < least:
            yield (
                f"fabric.{name} = {value:g} % is next to none, expected 0, or at least {least:g} %: if it is a "
                f"fraction, write {100.0 * value:g}"
            )
