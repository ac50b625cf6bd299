"""Strain at which a strip fails, and with it the share of a test that there is to run."""

from knittest.laboratory.base import Prepared
from knittest.laboratory.tensile.config import TensileRun

#: yarns of mean strength plus this many standard deviations have broken when a strip of yarns has failed
LAST_YARNS = 2.0


def expected_share(run: TensileRun, prepared: Prepared) -> float:
    """Share of the rig's motion after which the strip fails."""
    duration, start = prepared.rig.duration, 0.5 * run.solver.ramp_ms
    end = start + (duration - start) * failure_strain(run) / run.rig.max_strain
    return min(end / duration, 1.0)


def failure_strain(run: TensileRun) -> float:
    """Strain [%] at which a tensile strip has failed: that of its shells, or of the last of its yarns."""
    direction = run.rig.direction
    if run.model.scale == "macro":
        return float(run.fabric.macro.fracture_strain.of(direction).value)
    yarn = run.fabric.reinforcing
    fracture, crimp, slack = (
        yarn.fracture_strain, getattr(yarn.crimp, direction).value, getattr(yarn.slack, direction).value,
    )  # fmt: skip
    return float(fracture.value + LAST_YARNS * (fracture.sd or 0.0) + crimp + slack)
