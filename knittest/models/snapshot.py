"""State as a flat dictionary of arrays, ``nodes/position`` for example: what a checkpoint holds."""

from collections.abc import Iterable, Mapping

import numpy as np

from knittest.base.errors import InputError

State = dict[str, np.ndarray]


def arrays_of(prefix: str, holder: object, names: Iterable[str]) -> State:
    """Copies of the arrays ``names`` of ``holder``, keyed ``prefix/name``."""
    return {f"{prefix}/{name}": np.array(getattr(holder, name)) for name in names}


def put_back(state: Mapping[str, np.ndarray], prefix: str, holder: object, names: Iterable[str]) -> None:
    """Copy what :func:`arrays_of` took into the arrays of ``holder``, which kernels may hold: never replace them."""
    for name in names:
        target = getattr(holder, name)
        target[...] = entry(state, f"{prefix}/{name}", target.shape)


def entry(state: Mapping[str, np.ndarray], key: str, shape: tuple[int, ...] | None = None) -> np.ndarray:
    """Array ``key``; raises :class:`InputError` when it is not there or not of ``shape``."""
    if key not in state:
        raise InputError(f"the checkpoint has no {key}: it belongs to another model")
    value = state[key]
    if shape is not None and value.shape != shape:
        raise InputError(f"the checkpoint's {key} has shape {value.shape}, the model's {shape}: another model")
    return value


def under(state: Mapping[str, np.ndarray], prefix: str) -> State:
    """Entries ``prefix/...`` without the prefix."""
    return {k.removeprefix(prefix + "/"): v for k, v in state.items() if k.startswith(prefix + "/")}


def prefixed(prefix: str, state: Mapping[str, np.ndarray]) -> State:
    """Entries with ``prefix/`` put before their keys."""
    return {f"{prefix}/{k}": v for k, v in state.items()}


def columns(rows: list[dict[str, float]]) -> State:
    """Rows with equal keys as one array (n_rows,) a key."""
    return {k: np.array([row[k] for row in rows]) for k in rows[0]} if rows else {}


def rows_of(state: Mapping[str, np.ndarray]) -> list[dict[str, float]]:
    """Rows that :func:`columns` was made of."""
    lists = {k: v.tolist() for k, v in state.items()}
    return [dict(zip(lists, values, strict=True)) for values in zip(*lists.values(), strict=True)]
