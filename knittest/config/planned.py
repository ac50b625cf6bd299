"""Runs that a command, or a call in Python, asks for: one a direction where the specimen is a strip."""

from collections.abc import Mapping
from typing import Any

from knittest.base.kinds import kinds
from knittest.config.loading import planned_directions, resolve
from knittest.config.run import Run


def planned_runs(test: str, direction: str | None, chosen: Mapping[str, Any]) -> list[Run]:
    """Resolve the runs of ``test`` that the arguments ``chosen`` of :func:`resolve` describe.

    Both directions of a strip, unless ``direction`` or a setting asks for one.
    """
    if not kinds()[test].directional:
        return [resolve(test=test, **chosen)]
    directions = planned_directions(direction, chosen["config"], chosen["sets"])
    return [resolve(direction=one, test=test, **chosen) for one in directions]
