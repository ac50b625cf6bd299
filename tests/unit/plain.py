"""Compiled kernels as plain Python, so that their physics is judged within milliseconds and nothing is compiled."""

from collections.abc import Callable
from functools import cache
from types import FunctionType
from typing import Any

from numba.core.registry import CPUDispatcher


@cache
def plain(kernel: CPUDispatcher) -> Callable[..., Any]:
    """The Python function of ``kernel``, which calls the Python functions of all kernels that it calls."""
    function = kernel.py_func
    names = {n: v for n, v in function.__globals__.items() if n in function.__code__.co_names}
    called = {n: plain(v) for n, v in names.items() if isinstance(v, CPUDispatcher)}
    return FunctionType(function.__code__, function.__globals__ | called, function.__name__, function.__defaults__)
