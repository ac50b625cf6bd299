"""A file that is not a run, such as a sweep, as its model."""

from typing import TypeVar

from pydantic import BaseModel, ValidationError

from knittest.config.layers import Layers
from knittest.config.messages import input_error
from knittest.config.yaml_loader import Document

Parsed = TypeVar("Parsed", bound=BaseModel)


def parse_as(model: type[Parsed], document: Document) -> Parsed:
    """The ``model`` in ``document``; raises :class:`InputError` with every finding, each with file and line."""
    try:
        return model.model_validate(document.data)
    except ValidationError as error:
        layers = Layers(origin={(): document.where(())})
        for key, value in document.data.items():
            layers.lay(value, document.where, (key,))
        raise input_error(error, layers, model) from None
