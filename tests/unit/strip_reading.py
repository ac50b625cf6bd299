"""Reads files of strips for tests, with what a user states of them, and expects refusals."""

import pytest

from knittest.base.errors import InputError
from knittest.experiment.lab_conditions import GAUGE, WIDTH
from knittest.experiment.lab_strips import read_strips
from knittest.experiment.lab_table import ReadOptions


def read_lab(path, gauge_length=None, decimal=None, delimiter=None, width=None, sign="positive"):
    """Specimens in ``path``, with sizes [mm] where they are given."""
    sizes = {what.key: size for what, size in ((GAUGE, gauge_length), (WIDTH, width)) if size is not None}
    return read_strips(path, ReadOptions(decimal, delimiter, sign, sizes))


def refused(words, call, *args, **options):
    """Make a ``call``, which must raise :class:`InputError` with ``words`` (a pattern)."""
    with pytest.raises(InputError, match=words):
        call(*args, **options)
