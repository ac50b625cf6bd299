"""Size of the strip in a run."""

from math import sqrt

from knittest.laboratory.bias_extension.config import BiasExtensionRun


def stated(run: BiasExtensionRun) -> tuple[str, ...]:
    """Size of the strip, in words."""
    rig = run.rig
    return (f"strip on the bias {rig.width:g} mm wide, {rig.gauge_length:g} mm between the clamps",)


def sheet(run: BiasExtensionRun) -> tuple[float, float]:
    """Length and width [mm] over those of a diamond of four shells, in shells: they are counted by diamonds."""
    diamond = 2.0 * sqrt(2.0)
    return run.rig.gauge_length / diamond, run.rig.width / diamond
