"""A shear test ends where yarns press into each other with a tenth of the work, and says so."""

from types import SimpleNamespace

import numpy as np

from knittest.laboratory.judging import locking
from knittest.solve.simulate import LOCKED, START_ROWS, is_locked


def rows(contact, work, n=START_ROWS + 1):
    return [{"contact_mj": contact, "external_mj": work} for _ in range(n)]


def test_contacts_that_bear_a_tenth_of_the_work_lock():
    assert is_locked(rows(1.01 * LOCKED, 1.0)) and not is_locked(rows(0.99 * LOCKED, 1.0))
    assert not is_locked(rows(1.0, 1.0, START_ROWS)), "the start has no work yet"
    assert not is_locked([*rows(0.05, 1.0), *rows(0.05, 0.1)]), "work that a frame gives back counts"


def test_the_angle_is_named():
    history = SimpleNamespace(curve={"frame_shear_angle_deg": np.array([0.0, 24.2])})
    (said,) = locking(history, 45.0)
    assert "locks at 24.2 deg" in said and "before 45 deg" in said
    assert locking(history, 24.5) == ()
