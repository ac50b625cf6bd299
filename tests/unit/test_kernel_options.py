"""Fast-math flags of the kernels: none lets LLVM arrange a sum or a quotient anew in each kernel it is linked into."""

import importlib
import pkgutil

from numba.core.dispatcher import Dispatcher

from knittest import kernels
from knittest.kernels.tool_blocks import _speed

#: they change last bits from one linking to the next, or hide NaN and Inf
ANEW, HIDES = {"reassoc", "arcp", "afn", "fast"}, {"nnan", "ninf", "fast"}


def _compiled():
    modules = [
        importlib.import_module(one.name) for one in pkgutil.walk_packages(kernels.__path__, "knittest.kernels.")
    ]
    return {one.py_func: one for module in modules for one in vars(module).values() if isinstance(one, Dispatcher)}


def _flags(dispatcher):
    given = dispatcher.targetoptions.get("fastmath", False)
    return {"fast"} if given is True else set(given or ())


def test_no_kernel_may_be_rearranged_or_hides_what_is_not_a_number():
    found = _compiled()
    assert len(found) > 100
    assert [name for name, one in found.items() if _flags(one) & HIDES] == []
    assert [name for name, one in found.items() if _flags(one) & ANEW] == [_speed.py_func]
