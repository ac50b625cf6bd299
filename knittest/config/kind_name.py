"""The name of an installed test as a field of a file."""

from typing import Annotated, Any

from pydantic import BeforeValidator, GetJsonSchemaHandler
from pydantic_core import CoreSchema, PydanticCustomError

from knittest.base.kinds import kinds


def _known(value: object) -> object:
    """``value``; a finding as that of a literal, for what is none of the names."""
    if not isinstance(value, str) or value not in kinds():
        expected = " or ".join(repr(name) for name in kinds())
        raise PydanticCustomError("literal_error", "Input should be {expected}", {"expected": expected})
    return value


class _Names:
    """Lists the names in the JSON schema."""

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        return {"enum": list(kinds()), "type": "string"}


TestName = Annotated[str, BeforeValidator(_known), _Names]
