"""The tests by the name of their rig."""

from typing import Any

from knittest.laboratory.cantilever import Cantilever
from knittest.laboratory.forming import Forming
from knittest.laboratory.friction import Friction
from knittest.laboratory.picture_frame import PictureFrame
from knittest.laboratory.tensile import Tensile

TESTS: dict[str, Any] = {
    "tensile": Tensile(),
    "cantilever": Cantilever(),
    "friction": Friction(),
    "picture-frame": PictureFrame(),
    "forming": Forming(),
}
