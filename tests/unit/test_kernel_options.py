"""Options of the kernels: none lets LLVM arrange a sum anew in each kernel it is linked into, and none that lacks the
wrapper for Python is called from Python.
"""

import ast
import importlib
import pkgutil
from pathlib import Path

import pytest
from numba.core.dispatcher import Dispatcher

from knittest import kernels
from knittest.kernels.tool_contact import _speed

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


ROOT = Path(__file__).parents[2]
#: what looks at a kernel without calling its machine code
LOOKS = {"py_func", "signatures", "overloads"}


def _names(tree: ast.Module) -> dict[str, object]:
    """Modules of kernels, kernels and values that ``tree`` imports, by the name that it gives them."""
    found = {}
    for one in ast.walk(tree):
        if isinstance(one, ast.ImportFrom) and (one.module or "").startswith("knittest.kernels"):
            module = importlib.import_module(one.module)
            found |= {
                a.asname or a.name: (
                    getattr(module, a.name)
                    if hasattr(module, a.name)
                    else importlib.import_module(f"{one.module}.{a.name}")
                )
                for a in one.names
            }
    return found


def _kernel(node: ast.AST, names: dict[str, object]) -> Dispatcher | None:
    if isinstance(node, ast.Name):
        found = names.get(node.id)
    elif isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
        found = getattr(names.get(node.value.id), node.attr, None)
    else:
        found = None
    return found if isinstance(found, Dispatcher) else None


def called_without_wrapper(text: str) -> set[str]:
    """Kernels that Python of ``text`` may call though only kernels can, but in compiled functions of its own."""
    tree = ast.parse(text)
    names, looked = _names(tree), set()
    for one in ast.walk(tree):
        if isinstance(one, ast.Attribute) and one.attr in LOOKS:
            looked.add(id(one.value))
        if isinstance(one, ast.Call) and isinstance(one.func, ast.Name) and one.func.id in ("plain", "_llvm"):
            looked |= {id(a) for a in one.args}
        if isinstance(one, ast.FunctionDef) and any("njit" in ast.unparse(d) for d in one.decorator_list):
            looked |= {id(inner) for inner in ast.walk(one)}
    kernels_used = {k for n in ast.walk(tree) if id(n) not in looked and (k := _kernel(n, names))}
    return {k.py_func.__name__ for k in kernels_used if k.targetoptions.get("no_cpython_wrapper")}


@pytest.mark.parametrize("folder", ["knittest", "tests", "benchmarks", "docs"])
def test_python_calls_no_kernel_that_only_kernels_can_call(folder):
    """It would end the process without a word."""
    files = [f for f in (ROOT / folder).rglob("*.py") if "knittest/kernels" not in f.as_posix()]
    assert files
    found = {f.name: called for f in files if (called := called_without_wrapper(f.read_text()))}
    assert found == {}


@pytest.mark.parametrize(
    ("line", "called"),
    [
        ("next_partition(0, 0, 1)", {"next_partition"}),
        ("call(next_partition)", {"next_partition"}),
        ("next_partition.py_func(0, 0, 1)", set()),
        ("plain(next_partition)(0, 0, 1)", set()),
        ("threading.next_partition(0, 0, 1)", {"next_partition"}),
        ("threading.next_partition.py_func(0, 0, 1)", set()),
    ],
)
def test_a_call_is_seen(line, called):
    head = "from knittest.kernels.threading import next_partition\nfrom knittest.kernels import threading\n"
    assert called_without_wrapper(head + line) == called
