"""Text of knittest/__init__.pyi: what editors and type checkers see of names that are loaded when they are used."""

import inspect
from importlib.metadata import entry_points

import knittest
from knittest.api.tests import signature
from knittest.base.kinds import TestKind, kinds

HEAD = '''
"""The public names, with types. Written by python -m docs.generate: do not edit."""

import collections.abc
import os
import typing

import knittest.api.fabric
import knittest.api.run
from knittest import errors as errors
from knittest import pose as pose
'''.lstrip()


def stub() -> str:
    """Names of the package, then a function for each test that comes with it."""
    names = [f"from {m} import {n} as {n}" for n, m in sorted(knittest._PUBLIC.items(), key=_place)]
    shipped = sorted(one.name for one in entry_points(group="knittest.tests") if one.value.startswith("knittest."))
    functions = "\n".join(_function(kinds()[name]) for name in shipped)
    return "\n".join([HEAD.rstrip(), *names, "", "__version__: str", "", functions])


def _place(item: tuple[str, str]) -> tuple[str, bool, str]:
    """Order of imports: by module, classes first."""
    name, module = item
    return module, name.islower(), name


def _function(kind: TestKind) -> str:
    given = signature(kind)
    first, *others = (f"    {one}," for one in given.parameters.values())
    returned = inspect.formatannotation(given.return_annotation)
    name = kind.name.replace("-", "_")
    return "\n".join([f"def {name}(", first, "    *,", *others, f") -> {returned}:", f'    """{kind.summary}"""\n'])
