"""Shorter ends of a run that was refused or failed on its way to the full one: same motion, same gates, less of it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

from knittest.base.errors import InputError
from knittest.base.kinds import kinds
from knittest.config.base import field_meta
from knittest.config.number_path import number_path
from knittest.config.run import Run
from knittest.config.settings import Setting
from knittest.config.uncertainty import Uncertainty
from knittest.config.yaml_loader import Document, KeyPath
from knittest.laboratory.ending import Ending


@dataclass(frozen=True)
class Shorter:
    """Falling ``values`` of the ``field`` that ends the test, in ``unit``, if any; ``where`` the file has them."""

    field: str = ""
    values: tuple[float, ...] = ()
    unit: str = ""
    where: str = ""

    def setting(self, end: float) -> Setting:
        """Setting that lets a run end at ``end``."""
        return Setting(tuple(self.field.split(".")), end, self.where)


def ending_of(run: Run) -> Ending | None:
    """End of the motion of ``run``, None where its test has none that could be sooner."""
    kind = kinds()[run.rig.kind]
    found: Ending | None = kind.load("ending")(run) if kind.ending else None
    return found


def shorter_of(study: Uncertainty, document: Document, middle: Mapping[str, Run], drawn: Sequence[KeyPath]) -> Shorter:
    """Shorter ends of ``study``, whose fabrics run as ``middle`` at the medians of the fields ``drawn``.

    Raises :class:`InputError` for another field than the one that ends the test, one that is drawn, and for values
    that do not fall from the full end, cut the mean about a place, or give nothing that is asked for.
    """
    if not study.shorter:
        return Shorter()
    ((name, values),) = study.shorter.items()
    where = f"{document.where(('shorter', name))}: shorter.{name}"
    kind = next(iter(middle.values())).rig.kind
    path = number_path(name, document.where(("shorter", name)), [kind])
    if path in drawn:
        raise InputError(f"{where}: is one of the parameters: its draws are ends already, leave it out of one")
    told = ", ".join(f"{value:g}" for value in values)
    for fabric, run in middle.items():
        ending = ending_of(run)
        if ending is None or ending.field != name:
            said = f"expected {ending.field}" if ending else "it reads nothing before its end; leave shorter out"
            raise InputError(f"{where}: does not end this test ({kind}) sooner: {said}")
        _check_values(values, ending, study, f"{where} = [{told}]", fabric)
    unit = str(field_meta(type(run.rig), str(path[-1])).get("unit", ""))
    return Shorter(name, tuple(values), unit, document.where(("shorter", name)))


def _check_values(values: Sequence[float], ending: Ending, study: Uncertainty, said: str, fabric: str) -> None:
    for before, end in pairwise([ending.now, *values]):
        if end >= before:
            what = f"the full end of {fabric}" if before == ending.now else "the value before it"
            raise InputError(f"{said}: {end:g} must be below {what}, {before:g}: each try ends sooner than the last")
    places = sorted({at for one in study.quantities.values() for at in one.at})
    for end in values:
        cut = [at for at in places if end - ending.near < at <= end]
        if cut:
            raise InputError(
                f"{said}: {end:g} ends within the mean about {cut[0]:g}, which reaches {ending.near:g} beyond it: "
                f"expected {cut[0] + ending.near:g} or more, such as {cut[0] + 2.0 * ending.near:g}"
            )
        if not any(at <= end for at in places) and not any(one.any_end for one in study.quantities.values()):
            first = f"the first place is {places[0]:g}" if places else "no quantity has places (at), nor any_end: true"
            raise InputError(f"{said}: {end:g} gives nothing that is asked for: {first}")
