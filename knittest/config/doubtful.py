"""Numbers of a run that can be meant, but hardly are: what a warning says of them."""

from collections.abc import Iterator

from knittest.config.run import Run
from knittest.config.unread import unread_note

#: scale of the slack [%] below which it moves no result: a yarn of 200 mm is 0.04 mm longer
LEAST_SLACK = 0.02


def doubts(run: Run) -> list[str]:
    """Warnings of numbers that ``run`` does not read, and of those that are fractions in place of per cent."""
    return [*filter(None, [unread_note(run)]), *_slack_as_a_fraction(run)]


def _slack_as_a_fraction(run: Run) -> Iterator[str]:
    """Slack near none is no error, as studies draw it from 0 on."""
    if run.model.scale == "macro":
        return
    for direction in ("warp", "weft"):
        slack = run.fabric.reinforcing.slack.of(direction).value
        if 0.0 < slack < LEAST_SLACK:
            yield (
                f"fabric.reinforcing.slack.{direction} = {slack:g} % is next to none, expected 0, or at least "
                f"{LEAST_SLACK:g} %: if it is a fraction, write {100.0 * slack:g}"
            )
