"""Numbers of a run that can be meant, but hardly are: what a warning says of them."""

from collections.abc import Iterator

from knittest.config.run import Run
from knittest.config.unread import unread_note

#: scale of the slack [%] below which it moves no result: a yarn of 200 mm is 0.04 mm longer
LEAST_SLACK = 0.02
#: draw-in [%] below which it is lost in the scatter of any loop length
LEAST_DRAW_IN = 0.1


def doubts(run: Run) -> list[str]:
    """Warnings of numbers that ``run`` does not read, and of those that are fractions in place of per cent."""
    return [*filter(None, [unread_note(run)]), *_as_fractions(run)]


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
