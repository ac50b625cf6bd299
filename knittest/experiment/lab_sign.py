"""The sign of a pull: machines that also press count it either way."""

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import InputError

Array = NDArray[np.float64]
Sign = Literal["positive", "negative"]

#: share of the largest force that a force of the other sign stays below, such as noise or the weight of a clamp
OTHER = 0.5


def drawn(travel: Array, sign: Sign) -> Array:
    """``travel`` (n,) as rising: with a pull counted negative, travels may be too."""
    falls = travel[0] - travel.min() > travel.max() - travel[0]
    return -travel if sign == "negative" and falls else travel


def pulled(force: Array, sign: Sign, where: str) -> Array:
    """``force`` [N], (n,), with pull counted positive.

    ``sign`` is that of a pull in the file. Raises :class:`InputError` where the forces are rather of the other one.
    """
    signed = -force if sign == "negative" else force
    top, bottom = float(signed.max()), float(signed.min())
    if -bottom > OTHER * max(top, 0.0) and bottom < 0.0:
        other = "negative" if sign == "positive" else "positive"
        raise InputError(
            f"{where}: forces from {force.max():.4g} to {force.min():.4g} N, with a pull counted as {sign}: "
            f"compression, or the other sign? If it is a pull, give --sign {other}; else tare the force"
        )
    return signed
