"""What holds for all tests when several processes share them."""

import pytest


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_setupnodes() -> None:
    """Compile the kernels before the workers start: each of them would compile what it needs first, or wait for it."""
    from knittest.warmup import compile_all

    compile_all()
