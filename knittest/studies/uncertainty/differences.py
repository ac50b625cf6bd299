"""Numbers in which the fabrics of a study differ: only what the file says may."""

from collections.abc import Mapping, Sequence

from knittest.base.errors import InputError
from knittest.config.leaves import leaves
from knittest.config.run import Run
from knittest.config.uncertainty import Uncertainty
from knittest.config.yaml_loader import Document, shown

#: what names things: no run computes with it
_NAMES = ("fabric.name", "fabric.title", "fabric.experiment", "fabric.rigs", "output.")


def check_differences(runs: Mapping[str, Run], study: Uncertainty, document: Document) -> dict[str, list[object]]:
    """Values, in the order of ``runs``, of every field in which they differ.

    Raises :class:`InputError` for one that is not below a path of ``differ``.
    """
    found = differences(list(runs.values()))
    allowed = [tuple(name.split(".")) for name in study.differ]
    more = [name for name in found if not any(tuple(name.split("."))[: len(one)] == one for one in allowed)]
    if more:
        name = more[0]
        values = ", ".join(f"{fabric} {shown(value, 30)}" for fabric, value in zip(runs, found[name], strict=True))
        others = f"; so do {', '.join(more[1:])}" if more[1:] else ""
        raise InputError(
            f"{document.where(('fabrics',))}: the fabrics differ in {name} ({values}){others}: "
            "set it in base.set, make it a parameter, or name it in differ"
        )
    return found


def differences(runs: Sequence[Run]) -> dict[str, list[object]]:
    """Values of each field, by dotted path, in which ``runs`` differ; of runs of yarns without the shells' card."""
    flat = [dict(leaves(run.model_dump(mode="json"))) for run in runs]
    unread = (*_NAMES, "fabric.macro.") if runs[0].model.scale == "meso" else _NAMES
    names = dict.fromkeys(name for one in flat for name in one if not name.startswith(unread))
    values = {name: [one.get(name) for one in flat] for name in names}
    return {name: found for name, found in values.items() if any(value != found[0] for value in found)}
