"""The tests by the name of their rig."""

from typing import Any

from knittest.laboratory.tensile import Tensile

TESTS: dict[str, Any] = {"tensile": Tensile()}
