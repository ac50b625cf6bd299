"""Cycles of a picture frame: work of loading, what a cycle takes, and what is left where the force is gone.

Of shells whose shear law S = s gamma has a share f of friction behind a spring as stiff as the law, a first cycle to
gamma takes f s gamma^2 (1 - f) / (1 + f) per area, 2 f (1 - f) / (1 + f) of the work of loading.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Cycle:
    """Work of loading and loss (area of the loop) [mJ], share of the loss in the work [%], angle on the way back at
    which the force is gone [deg], nan where it stays, and time of its start and end [ms].
    """

    work: float
    loss: float
    share: float
    residual: float
    begin: float
    end: float


def cycles_of(curve: Mapping[str, Array], count: int) -> list[Cycle]:
    """The ``count`` cycles of ``curve``, each from a smallest angle to the next; those that were not finished are not
    there.
    """
    angle, force, way = (curve[name] for name in ("frame_shear_angle_deg", "shear_force_n", "displacement_mm"))
    if not len(angle) or not count:
        return []
    half = 0.5 * float(angle.max())
    up = np.flatnonzero((angle[1:] > half) & (angle[:-1] <= half))
    down = np.flatnonzero((angle[1:] <= half) & (angle[:-1] > half))
    ends = [int(d + np.argmin(angle[d : (up[k + 1] if k + 1 < len(up) else len(angle))])) for k, d in enumerate(down)]
    found = []
    for k, end in enumerate(ends[:count]):
        start = ends[k - 1] if k else 0
        top = start + int(np.argmax(angle[start : end + 1]))
        work = float(np.trapezoid(force[start : top + 1], way[start : top + 1]))
        loss = float(np.trapezoid(force[start : end + 1], way[start : end + 1]))
        gone = np.flatnonzero(force[top : end + 1] <= 0.0)
        residual = float(angle[top + gone[0]]) if len(gone) else float("nan")
        time = curve["time_ms"]
        share = 100.0 * loss / work if work > 0.0 else float("nan")
        found.append(Cycle(work, loss, share, residual, float(time[start]), float(time[end])))
    return found


def cycle_results(curve: Mapping[str, Array], energies: Mapping[str, Array], count: int) -> dict[str, float]:
    """Numbers of the first and, where there are more, of the last cycle; friction's share [%] in the loss of the first,
    by the energies.
    """
    if not count:
        return {}
    found = cycles_of(curve, count)
    if len(found) < count:
        return {"cycle_work_mj": float("nan"), "cycle_loss_mj": float("nan"), "cycle_loss_share_pct": float("nan")}
    first, last = found[0], found[-1]
    rubbed = np.interp([first.begin, first.end], energies["time_ms"], energies["friction_mj"])
    results = {
        "cycle_work_mj": first.work,
        "cycle_loss_mj": first.loss,
        "cycle_loss_share_pct": first.share,
        "cycle_friction_share_pct": 100.0 * float(rubbed[1] - rubbed[0]) / first.loss if first.loss else float("nan"),
        "cycle_residual_angle_deg": first.residual,
    }
    return results | ({"last_cycle_loss_share_pct": last.share} if count > 1 else {})
