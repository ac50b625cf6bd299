"""Needles along the sides of a rectangle of yarns, on which their ends and the loops at its edges hang."""

import numpy as np
from numpy.typing import NDArray


def on_needles(beyond: NDArray[np.float64], chain: NDArray[np.int64]) -> NDArray[np.int64]:
    """Nodes that hang on needles, about which the yarns may turn: the ends of each ``chain`` (n,) and the crests of
    those loops that no further course holds, ``beyond`` (n,) [mm] the sides across the wales.
    """
    change = chain[1:] != chain[:-1]
    ends = np.append(True, change) | np.append(change, True)
    crest = np.append(False, (beyond[1:-1] >= beyond[:-2]) & (beyond[1:-1] > beyond[2:]))
    return np.flatnonzero(ends | (np.append(crest, False) & (beyond > 0.0)))
