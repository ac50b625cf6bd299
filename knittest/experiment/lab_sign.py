"""The sign of a pull: machines that also press count it either way."""

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from knittest.errors import InputError

Array = NDArray[np.float64]
Sign = Literal["positive", "negative"]

#: share of the largest force that a force of the other sign stays below, such as noise or the weight of a clamp
OTHER = 0.5


def pulled(travel: Array, force: Array, sign: Sign, where: str) -> tuple[Array, Array]:
    """``travel`` and ``force`` [N], (n,) each, with pull counted positive.

    ``sign`` is that of a pull in the file. Raises :class:`InputError` where the forces are rather of the other one.
    """
    if sign == "negative":
        force = -force
        travel = -travel if travel[-1] < travel[0] else travel
    top, bottom = float(force.max()), float(force.min())
    if -bottom > OTHER * max(top, 0.0) and bottom < 0.0:
        high, low = (top, bottom) if sign == "positive" else (-bottom, -top)
        other = "negative" if sign == "positive" else "positive"
        raise InputError(
            f"{where}: forces from {low:.4g} to {high:.4g} N, with a pull counted as {sign}: compression, or the other "
            f"sign? If it is a pull, give --sign {other}; else tare the force"
        )
    return travel, force
