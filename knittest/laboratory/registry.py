"""The tests by the name of their rig."""

from typing import Any

from knittest.laboratory.cantilever.test import Cantilever
from knittest.laboratory.forming.test import Forming
from knittest.laboratory.friction.test import Friction
from knittest.laboratory.picture_frame.test import PictureFrame
from knittest.laboratory.tensile.test import Tensile

TESTS: dict[str, Any] = {
    "tensile": Tensile(),
    "cantilever": Cantilever(),
    "friction": Friction(),
    "picture-frame": PictureFrame(),
    "forming": Forming(),
}
