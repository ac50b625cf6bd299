"""One line of the verification report."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Row:
    """A ``quantity`` of ``case`` as computed on ``mesh`` against its ``reference`` from ``source``.

    ``order`` is the observed order of convergence over the meshes named, None where the case has none; ``series`` the
    errors on them, for the plot.
    """

    case: str
    source: str
    quantity: str
    reference: float
    result: float
    mesh: str
    order: float | None
    series: tuple[float, ...] = ()

    @property
    def error(self) -> float:
        """Deviation over the reference, or the result itself where the reference is zero."""
        return self.result / self.reference - 1.0 if self.reference != 0.0 else self.result
