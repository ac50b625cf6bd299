"""Thickness over pressure: readings, and the law of van Wyk (1946, J. Text. Inst. 37, T285) with a free exponent.

Fibres of a mass that is pressed bend between their contacts, whose number grows as they close up:
p = k (1 / t^n - 1 / t0^n) with n = 3, t0 the thickness without pressure.
"""

from dataclasses import dataclass

import numpy as np

from knittest.base.history import Array

#: pressures at which the thickness is read [kPa]: with less the curl of a piece is flattened, and nothing compacted
PRESSURES = (1.0, 10.0, 100.0, 1000.0)
#: bounds of the exponent, and places of the fit a decade of pressure
EXPONENTS, PLACES = (0.5, 60.0), 10
#: sd of ln p about the fit above which the curve does not follow the law, and has no exponent
LARGEST_SCATTER = 0.3


@dataclass(frozen=True)
class VanWyk:
    """Exponent n [-], thickness t0 [mm] and factor k [kPa mm^n] of a fit; ``scatter`` is the sd of ln p about it."""

    exponent: float
    thickness: float
    factor: float
    scatter: float

    @property
    def follows(self) -> bool:
        """Tell whether the curve follows the law, with an exponent inside its bounds."""
        return self.scatter <= LARGEST_SCATTER and EXPONENTS[0] * 1.01 < self.exponent < EXPONENTS[1] * 0.99

    def pressure(self, thickness: Array) -> Array:
        """Pressure [kPa] at ``thickness`` [mm], (n,)."""
        return np.asarray(self.factor * (thickness**-self.exponent - self.thickness**-self.exponent))


def first_loading(thickness: Array, pressure: Array) -> tuple[Array, Array]:
    """Thickness [mm] and pressure [kPa] of the rows with a larger pressure than before, (n,)."""
    before = np.concatenate([[0.0], np.maximum.accumulate(pressure)[:-1]])
    grown = pressure > np.maximum(before, 0.0)
    return thickness[grown], pressure[grown]


def thickness_at(thickness: Array, pressure: Array, at: float) -> float:
    """Thickness [mm] at the pressure ``at`` [kPa], interpolated over its logarithm; nan outside the first loading."""
    t, p = first_loading(thickness, pressure)
    if len(p) < 2 or not p[0] <= at <= p[-1]:
        return float("nan")
    return float(np.interp(np.log(at), np.log(p), t))


def work(thickness: Array, pressure: Array) -> float:
    """Work of compaction per area [J/m2] up to the largest pressure: kPa mm are J/m2."""
    last = int(np.argmax(pressure)) + 1
    return float(-np.trapezoid(pressure[:last], thickness[:last]))


def fit(thickness: Array, pressure: Array) -> VanWyk | None:
    """Law by least squares of ln p at places even over the logarithm of the pressure; None below a decade."""
    from scipy.optimize import least_squares

    t, p = first_loading(thickness, pressure)
    p_low = max(float(p[0]), PRESSURES[0]) if len(p) > 2 else np.inf
    decades = np.log10(p[-1] / p_low) if len(p) > 2 and p[-1] > p_low else 0.0
    if decades < 1.0:
        return None
    ln_p = np.linspace(np.log(p_low), np.log(p[-1]), int(PLACES * decades) + 1)
    places = np.interp(ln_p, np.log(p), t)
    thickest = float(places.max())

    def misfit(x: Array) -> Array:
        """Difference of ln p, for n, ln(t0 - t_max) and ln k."""
        n, start = x[0], thickest + np.exp(x[1])
        ratio = n * np.log(start / places)
        return np.asarray(x[2] - n * np.log(start) + np.log(np.expm1(ratio)) - ln_p)

    least, most = (np.log(share * thickest) for share in (1e-6, 1.0))
    bounds = (EXPONENTS[0], least, -np.inf), (EXPONENTS[1], most, np.inf)
    starts = [(n, np.log(0.01 * thickest), ln_p.mean()) for n in (1.0, 3.0, 10.0)]
    tries = [least_squares(misfit, start, bounds=bounds, x_scale="jac") for start in starts]
    best = min(tries, key=lambda one: float(one.cost))
    n, start = float(best.x[0]), thickest + float(np.exp(best.x[1]))
    return VanWyk(n, start, float(np.exp(best.x[2])), float(best.fun.std()))
