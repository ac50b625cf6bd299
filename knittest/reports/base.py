"""What the reports share."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from knittest.config.run import Run
from knittest.experiment.curves import ReferenceCurve
from knittest.experiment.tables import PublishedValue
from knittest.export import energy_picture
from knittest.specimen import Specimen

Columns = dict[str, np.ndarray]


@dataclass(frozen=True)
class References:
    """Published rows and the reference curve, if there are any."""

    rows: Sequence[PublishedValue] = ()
    curve: ReferenceCurve | None = None


class Report(Protocol):
    """How a test is compared and shown; pictures show the first specimen."""

    def scaled(self, run: Any, rows: Sequence[PublishedValue]) -> list[PublishedValue]:
        """Published rows for the size of the run's specimen."""

    def reference_curve(self, run: Any) -> ReferenceCurve | None:
        """The curve that the run's curve is compared with."""

    def compare(self, run: Any, specimens: list[Specimen], curve: ReferenceCurve) -> list[dict[str, Any]]:
        """Metrics against the reference curve, for comparison.json."""

    def curve(self, specimens: list[Specimen]) -> Columns:
        """Columns of curve.csv."""

    def pictures(self, run: Any, specimens: list[Specimen], references: References, folder: Path) -> None:
        """Write the pictures."""


def title_of(run: Run) -> str:
    """Title of the pictures."""
    what = " ".join(part for part in (run.rig.kind, run.direction) if part)
    return f"{run.fabric.name}, {what}, {run.model.scale} ({run.parameters})"


def draw_energies(run: Run, specimens: list[Specimen], folder: Path) -> None:
    """energies.png of the first specimen, with the limits of the gates."""
    energy_picture.energy_picture(
        folder / "energies.png", specimens[0].history, title=title_of(run),
        kinetic_limit=0.01 * run.solver.max_kinetic_ratio, energy_limit=0.01 * run.solver.max_energy_error,
    )  # fmt: skip
