"""Settings for all tests when two processes share them (``-n 2``)."""

import os
from collections.abc import Iterator

import pytest


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_setupnodes() -> None:
    """Compile the kernels before the workers start: each of them would compile what it needs first, or wait for it."""
    from knittest.solve.compilation import compile_all

    compile_all()


@pytest.fixture(scope="session", autouse=True)
def one_thread_each() -> Iterator[None]:
    """Give a worker one thread where nobody asks for a number: threads that wait for each other's core burn time."""
    if "PYTEST_XDIST_WORKER" not in os.environ:
        yield
        return
    import numba

    from knittest.kernels import threading

    best_threads = threading.best_threads
    numba.set_num_threads(1)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(threading, "best_threads", lambda wanted: best_threads(wanted or 1))
        yield


@pytest.fixture(autouse=True)
def no_width(monkeypatch: pytest.MonkeyPatch) -> None:
    """Lines are as long as they are, unless a test sets COLUMNS itself: workers have it of their terminal."""
    monkeypatch.delenv("COLUMNS", raising=False)
