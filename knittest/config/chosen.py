"""The fabric that the file of a study names."""

from typing import Annotated, Any

from pydantic import BeforeValidator, Field

from knittest.config.base import Strict


def _named(value: object) -> Any:
    return str(value) if isinstance(value, int) and not isinstance(value, bool) else value


class Chosen(Strict):
    """A fabric, shipped or a file."""

    variant: Annotated[str | None, BeforeValidator(_named)] = Field(
        None, description="shipped fabric: 1, 2, or a name of configs/NAME.yaml"
    )
    fabric: str | None = Field(None, description="fabric file, seen from the folder of this file")
