"""Runs from defaults, preset, fabric file with parameter set, config file, options and ``--set``, in this order."""

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any, TypedDict, Unpack, get_args

from pydantic import ValidationError

from knittest.base.errors import InputError
from knittest.base.kinds import DEFAULT, kinds
from knittest.config.fabric import Direction, Fabric
from knittest.config.messages import input_error, unknown_name_text
from knittest.config.presets import default_scale, preset_paths, preset_settings
from knittest.config.rigs import StripRig
from knittest.config.run import RUNS, Model, Preset, Run, Scale
from knittest.config.settings import (
    Layers,
    Setting,
    check_own_yarns,
    lay_setting,
    parse_set,
    refuse_contradictions,
)
from knittest.config.sources import FabricSource, fabric_file, lay_fabric, resolve_data_paths, test_file, variant_path
from knittest.config.yaml_loader import Document, KeyPath, describe, dotted_path, value_excerpt

DIRECTIONS: tuple[str, ...] = get_args(Direction)


def rig_default_paths(own: Mapping[str, object], kind: str, direction: object) -> dict[str, KeyPath]:
    """Path below ``own``, the rig defaults of a fabric for ``kind``, of each rig field of a run in ``direction``.

    Numbers of the direction override those of both. Numbers of the other direction alone hold too, as for a test
    without directions: see :func:`taken_over`.
    """
    per = [d for d in DIRECTIONS if isinstance(own.get(d), Mapping)]
    direction = direction if kinds()[kind].directional else ""
    others = [d for d in per if d != direction]
    found: dict[str, KeyPath] = {key: (d, key) for d in others if len(others) == 1 for key in own[d]}  # type: ignore[attr-defined]
    found |= {key: (key,) for key in own if key not in per}
    return found | {key: (d, key) for d in per if d == direction for key in own[d]}  # type: ignore[attr-defined]


def other_direction_fields(fabric: Fabric, kind: str, direction: str) -> dict[str, str]:
    """Rig fields of a test of ``kind`` in ``direction`` that the fabric has for the other direction only, and that."""
    paths = rig_default_paths(fabric.rigs.get(kind, {}), kind, direction)
    return {key: str(path[0]) for key, path in paths.items() if len(path) > 1 and path[0] != direction}


def rig_default_value(fabric: Fabric, kind: str, path: KeyPath) -> float:
    """Number of the fabric at ``path`` of :func:`rig_default_paths`."""
    found = fabric.rigs[kind][str(path[0])]
    return float(found[str(path[1])] if isinstance(found, dict) else found)


def _lay_rig_defaults(layers: Layers, kind: str, direction: object, stated: Collection[str] = ()) -> None:
    """Lay the rig defaults of the fabric in ``layers`` for a test of ``kind`` in ``direction`` over the rig.

    Sizes of the preset stay, and so do ``stated`` fields with those tied to them. Raises :class:`InputError` for
    numbers of both directions in a test without directions.
    """
    at: KeyPath = ("fabric", "rigs", kind)
    own = layers.get(at)
    if not isinstance(own, dict):
        return
    if not kinds()[kind].directional and all(isinstance(own.get(d), dict) for d in DIRECTIONS):
        raise InputError(
            f"{layers.place_of((*at, DIRECTIONS[0]))}: {dotted_path(at)}: found numbers of warp and weft, but the "
            f"test has no "
            "direction: expected one number, such as their mean"
        )
    record = kinds()[kind]
    kept = {*(set(record.sizes) & (layers.get(("rig",)) or {}).keys()), "kind", *stated}
    kept |= {field for field, other in record.tied.items() if other in kept}
    for key, path in rig_default_paths(own, kind, direction).items():
        if key not in kept:
            where = str(layers.place_of((*at, *path)))
            layers.lay(layers.get((*at, *path)), lambda _, where=where: where, ("rig", key))  # type: ignore[misc]


#: field that accepts limits looser than the preset's
ACCEPTED: KeyPath = ("accept_limits",)
#: beams per wave of the inlays and per loop, derived from the fabric unless given
WAVES: KeyPath = ("model", "meso", "elements_per_wave")
LOOPS: KeyPath = ("model", "meso", "elements_per_loop")


class Options(TypedDict, total=False):
    """Options of the command line for fields of a run; ``None``: the config file or the default decides."""

    scale: str | None
    direction: str | None
    preset: str | None
    parameters: str | None
    specimens: int | None
    seed: int | None


#: field of a run that an option sets
_STATED: dict[str, KeyPath] = {
    "scale": ("model", "scale"), "direction": ("rig", "direction"), "preset": ("model", "preset"),
    "parameters": ("parameters",), "specimens": ("variability", "specimens"), "seed": ("variability", "seed"),
}  # fmt: skip


def resolve(
    *,
    variant: str | None = None,
    fabric: Path | str | None = None,
    config: Path | str | None = None,
    sets: Sequence[str | Setting] = (),
    test: str | None = None,
    accept_limits: bool | None = False,
    **asked: Unpack[Options],
) -> Run:
    """Resolve the run that the arguments describe; ``None`` leaves a choice to the config file or the default.

    ``variant`` names a shipped fabric, ``fabric`` is a fabric file, ``config`` a rig file or a whole run (as
    :func:`knittest.config.yaml_writer.dump` writes it), ``sets`` are ``key.path=value`` texts or settings, ``test``
    is the kind of test, and the rest are :class:`Options`. ``accept_limits`` overrides the config; ``None`` keeps its
    value, to resume a run. Raises :class:`InputError` listing every finding.
    """
    document = _run_document(config)
    kind = _test_name(document, test)
    options = _option_settings(asked)
    given = _to_settings(sets)
    refuse_contradictions(options, given)
    source = _fabric_source(variant, fabric, document, config)
    for setting in given:
        if setting.path == ACCEPTED:
            raise InputError(f"{setting.place}: {dotted_path(ACCEPTED)} cannot be set: use --accept-limits instead")
        if setting.path[:2] == ("fabric", "rigs"):
            raise InputError(f"{setting.place}: set the rig of the run instead: --set rig.{setting.path[-1]}=...")
    layers = _lay_all(document, source, options + given, kind)
    if accept_limits is not None:
        layers.lay({"accept_limits": accept_limits}, lambda path: "--accept-limits")
    try:
        run = RUNS[kind].model_validate(layers.data)
    except ValidationError as error:
        raise input_error(error, layers) from None
    folders = [source.folder] if config is None else [source.folder, Path(config).resolve().parent]
    if _stated_value(WAVES, document, given) is None:
        run = run.with_fine_waves()
    if _stated_value(LOOPS, document, given) is None:
        run = run.with_fine_loops()
    of_fabric = {("rig", key) for key in rig_default_paths(run.fabric.rigs.get(kind, {}), kind, run.direction)}
    for path, value in run.structure_defaults().items():
        if path not in of_fabric and _stated_value(path, document, given) is None:
            part = getattr(run, path[0]).model_copy(update={path[1]: value})
            run = run.model_copy(update={path[0]: part})
    return resolve_data_paths(run, layers, folders).with_derived_numbers()


def resolve_directions(
    direction: str | None, config: Path | str | None = None, sets: Sequence[str | Setting] = ()
) -> list[Direction]:
    """Directions to run: ``direction``, else that of the config or ``--set``, else both."""
    both: tuple[Direction, ...] = get_args(Direction)
    if direction is not None:
        return [d for d in both if direction in (d, "both")]
    given = _to_settings(sets)
    stated = _chosen_value(("rig", "direction"), both, None, _run_document(config), given)
    return [stated] if stated else list(both)


def _to_settings(sets: Sequence[str | Setting]) -> list[Setting]:
    return [parse_set(one) if isinstance(one, str) else one for one in sets]


def _test_name(document: Document, asked: str | None) -> str:
    """Kind of test: that of the command, which a config file may not contradict, else of the file, else the default."""
    stated = Layers(document.data).get(("rig", "kind"))
    if stated is not None and stated not in RUNS:
        names = unknown_name_text(str(stated), list(RUNS), "test")
        raise InputError(f"{document.place_of(('rig', 'kind'))}: rig.kind = {value_excerpt(stated)}: {names}")
    if stated is not None and asked is not None and stated != asked:
        raise InputError(
            f"{document.place_of(('rig', 'kind'))}: rig.kind = {stated}: the file is for another test: use knittest "
            f"{stated}"
        )
    return str(stated or asked or DEFAULT)


def _run_document(config: Path | str | None) -> Document:
    return Document("defaults", {}) if config is None else test_file(Path(config))


def _option_settings(asked: Options) -> list[Setting]:
    """Settings of the given options; raises ``TypeError`` for an unknown one."""
    if unheard := asked.keys() - _STATED.keys():
        raise TypeError(f"resolve() got unexpected arguments: {', '.join(sorted(unheard))}")
    given = {name: value for name, value in asked.items() if value is not None}
    return [Setting(path, given[name], f"--{name}") for name, path in _STATED.items() if name in given]


def _fabric_source(
    variant: str | None, fabric: Path | str | None, document: Document, config: Path | str | None
) -> FabricSource:
    inline = "fabric" in document.data
    ways = [
        *([f"--variant {variant}"] if variant is not None else []),
        *([f"--fabric {fabric}"] if fabric is not None else []),
        *([f"the fabric in {document.place_of(('fabric',))}"] if inline else []),
    ]
    if len(ways) > 1:
        raise InputError(f"more than one fabric is given, {' and '.join(ways)}: give only one")
    if inline:
        return FabricSource(document, ("fabric",), Path(str(config)).resolve().parent, inline=True)
    if fabric is not None:
        return fabric_file(Path(fabric))
    if variant is not None:
        return fabric_file(variant_path(variant))
    raise InputError("no fabric is given: expected --variant 1, --variant 2, --variant NAME or --fabric FILE")


def _lay_all(document: Document, source: FabricSource, settings: list[Setting], kind: str) -> Layers:
    scale = _chosen_value(("model", "scale"), get_args(Scale), default_scale(kind), document, settings)
    preset = _chosen_value(("model", "preset"), get_args(Preset), Model().preset, document, settings)
    layers = Layers()
    layers.lay({"rig": {"kind": kind}}, lambda path: "the command")
    chosen_sizes = preset_settings(kind, preset, scale, lambda field: _stated_value(("rig", field), document, settings))
    layers.lay(chosen_sizes, lambda path: f"preset {preset}")
    wanted = _stated_value(("parameters",), document, settings)
    if wanted is not None and not isinstance(wanted, str):
        raise InputError(f"{document.place_of(('parameters',))}: parameters: expected a name, found {describe(wanted)}")
    chosen = lay_fabric(layers, source, wanted)
    stated = {key for key in kinds()[kind].tied.values() if _stated_value(("rig", key), document, settings) is not None}
    direction = _stated_value(("rig", "direction"), document, settings) or StripRig().direction
    _lay_rig_defaults(layers, kind, direction, stated)
    _refuse_shadowed_preset(document, layers, preset, kind)
    rest = {key: value for key, value in document.data.items() if key != "fabric"}
    for key, value in rest.items():
        if isinstance(layers.get((key,)), dict) and not isinstance(value, dict):
            where = document.place_of((key,))
            raise InputError(f"{where}: {key} = {value_excerpt(value)}: expected a mapping with fields")
    layers.lay(rest, document.place_of)
    for setting in settings:
        lay_setting(layers, setting)
    check_own_yarns(layers, settings)
    layers.lay(chosen, lambda path: source.document.source, ("parameters",))
    return layers


def _stated_value(path: KeyPath, document: Document, settings: list[Setting]) -> Any:
    """Value at ``path`` of the command line, else of the config file."""
    for setting in reversed(settings):
        if setting.path == path:
            return setting.value
    return Layers(document.data).get(path)


def _chosen_value(
    path: KeyPath, names: tuple[Any, ...], default: object, document: Document, settings: list[Setting]
) -> Any:
    """Value of a field that must be known before the run can be resolved."""
    stated = _stated_value(path, document, settings)
    if stated is None:
        return default
    if stated not in names:
        places = [s.place for s in settings if s.path == path]
        where = places[-1] if places else document.place_of(path)
        raise InputError(
            f"{where}: {dotted_path(path)} = {value_excerpt(stated)}: "
            f"{unknown_name_text(str(stated), list(names), 'choice')}"
        )
    return stated


def _refuse_shadowed_preset(document: Document, layers: Layers, preset: str, kind: str) -> None:
    """Raise :class:`InputError` if a config that was written for another preset would keep the values of that one."""
    written = Layers(document.data)
    if written.get(("model", "preset")) in (None, preset):
        return
    for path in preset_paths(kind):
        value = written.get(path)
        if value is not None and value != layers.get(path):
            raise InputError(
                f"{document.place_of(path)}: {dotted_path(path)} = {value_excerpt(value)} of the file would "
                f"override preset {preset} "
                f"({value_excerpt(layers.get(path))}): remove it from the file, or change it with --set"
            )


def resolve_test_runs(test: str, direction: str | None, chosen: Mapping[str, Any]) -> list[Run]:
    """Resolve the runs of ``test`` that the arguments ``chosen`` of :func:`resolve` describe, one per direction."""
    if not kinds()[test].directional:
        return [resolve(test=test, **chosen)]
    directions = resolve_directions(direction, chosen["config"], chosen["sets"])
    return [resolve(direction=one, test=test, **chosen) for one in directions]
