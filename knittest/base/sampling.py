"""Error of a mean of few specimens."""

import math
from collections.abc import Mapping

from knittest.base.summary import Value

#: probability that the mean of all specimens there could be lies within the error
CONFIDENCE = 0.95


def mean_error(value: Value) -> float:
    """Half of the interval of Student's t that holds the mean of all specimens there could be, by those of ``value``.

    0 of a single number, which is no mean; of specimens that lack a value not known (nan).

    >>> round(mean_error({"mean": 3.0, "sd": 2.0**0.5, "values": [2.0, 4.0]}), 2)
    12.71
    """
    if not isinstance(value, Mapping):
        return 0.0
    from scipy.special import stdtrit  # heavy

    count, sd = len(value["values"]), value["sd"]
    if sd is None or count < 2:
        return math.nan
    return float(stdtrit(count - 1, 0.5 * (1.0 + CONFIDENCE))) * sd / math.sqrt(count)
