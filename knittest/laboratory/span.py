"""The part of a run by which its energies are judged."""

from dataclasses import dataclass

import numpy as np

from knittest.base.history import History, judged_rows


@dataclass(frozen=True)
class Span:
    """Part of a test that is judged: to the first failure or to the end; its first number is ``reported_from`` [ms]."""

    to_failure: bool = False
    reported_from: float = np.inf

    def rows(self, history: History) -> slice:
        """Rows of the energies."""
        return judged_rows(history, to_failure=self.to_failure, reported_from=self.reported_from)
