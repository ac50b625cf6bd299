"""The rating against an implementation of ISO/TS 18571 by others: ``objective-rating-metrics`` of TU Graz.

Both follow the same standard and add the same numbers in another order, so that they must agree to rounding; 1e-6 is
asked for. The package takes curves over time and knows nothing of strain: the grid becomes seconds at 10 kHz.
"""

import numpy as np
import pytest

from knittest.experiment.comparison import rate

rating = pytest.importorskip("objective_rating_metrics.rating")

N = 201
X = np.linspace(0.0, 1.0, N)


def toe(x):
    """A tensile curve: toe, straight part, drop."""
    return np.where(x < 0.9, np.maximum(x, 0.0) ** 1.6, 0.85 * np.exp(-(x - 0.9) / 0.02))


def pulse(x, at=0.5):
    return np.exp(-(((x - at) / 0.12) ** 2)) - 0.3 * np.exp(-(((x - at - 0.2) / 0.08) ** 2))


def noise(seed, size):
    return size * np.random.default_rng(seed).standard_normal(N)


def walk(seed):
    """A smooth random curve."""
    steps = np.random.default_rng(seed).standard_normal(N + 30)
    return np.convolve(steps, np.ones(31) / 31.0, "valid").cumsum()


PAIRS = {
    "scaled": (1.15 * toe(X), toe(X)),
    "shifted left": (pulse(X, 0.43), pulse(X)),
    "shifted right, scaled": (0.8 * pulse(X, 0.58), pulse(X)),
    "noise": (toe(X) + noise(1, 0.02), toe(X)),
    "noise on both": (toe(X) + noise(2, 0.05), 0.9 * toe(X - 0.02) + noise(3, 0.05)),
    "steeper": (X**3, X**1.4),
    "other slope and offset": (200.0 + 5800.0 * X**1.2, 5200.0 * X**1.5),
    "plateaus": (np.round(6.0 * toe(X + 0.03)), np.round(6.0 * toe(X))),
    "falling": (1.0 - X**2 + noise(4, 0.01), np.cos(1.5 * X)),
    "unlike": (walk(5), walk(6)),
}


def outside(curve, reference) -> dict[str, float]:
    time = np.arange(len(curve)) * 1e-4
    judge = rating.ISO18571(np.column_stack([time, reference]), np.column_stack([time, curve]))
    names = ("corridor", "phase", "magnitude", "slope", "overall")
    return {name: float(getattr(judge, f"{name}_rating")(ndigits=-1)) for name in names}


@pytest.mark.parametrize("pair", PAIRS)
def test_every_score_agrees(pair):
    assert rate(*PAIRS[pair]) == pytest.approx(outside(*PAIRS[pair]), rel=0.0, abs=1e-6)


def test_the_pairs_ask_every_score():
    """Each score is neither all right nor all wrong on at least three pairs."""
    scores = [rate(*pair) for pair in PAIRS.values()]
    for name in scores[0]:
        assert sum(0.01 < each[name] < 0.99 for each in scores) >= 3, name
