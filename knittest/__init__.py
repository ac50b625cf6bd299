"""knittest: virtual material tests of biaxial weft-knitted fabrics.

A test in Python, with what is heavy imported when it is first used:

    import knittest

    run = knittest.run_test("NAME", fabric="2", preset="quick")  # or knittest.NAME(fabric="2", preset="quick")
    run.plot()
"""

import importlib
from typing import Any

__version__ = "0.3.0"

#: name that is loaded when it is first used: module that holds it
_PUBLIC = {
    **dict.fromkeys(("run_test", "resume"), "knittest.api.tests"),
    **dict.fromkeys(("Gates", "QualityChecks", "Run", "Runs", "load"), "knittest.api.run"),
    **dict.fromkeys(("Study", "batch", "calibrate", "homogenise", "uncertainty"), "knittest.api.studies"),
    "Fabric": "knittest.api.fabric",
    "InputError": "knittest.base.errors",
}
_MODULES = ("errors", "pose")

__all__ = ["__version__", *_PUBLIC, *_MODULES]


def __getattr__(name: str) -> Any:
    """Load a public name; raises ``AttributeError`` with the nearest one for one there is not."""
    if name in _MODULES:
        return importlib.import_module(f"knittest.{name}")
    if name in _PUBLIC:
        found = getattr(importlib.import_module(_PUBLIC[name]), name)
        globals()[name] = found
        return found
    if not name.startswith("_") and name in (tests := _tests()):
        found = importlib.import_module("knittest.api.tests").test_function(tests[name])
        globals()[name] = found
        return found
    import difflib

    close = [] if name.startswith("_") else difflib.get_close_matches(name, [*__all__, *_tests()], 1, 0.6)
    hint = f' (did you mean "{close[0]}"?)' if close else ""
    raise AttributeError(f"module 'knittest' has no attribute {name!r}{hint}", name=name)


def _tests() -> dict[str, Any]:
    """Records of all installed tests by the names of their functions."""
    kinds = importlib.import_module("knittest.base.kinds").kinds()
    return {name.replace("-", "_"): kind for name, kind in kinds.items()}


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__, *_tests()})
