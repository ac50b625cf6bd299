"""Puts runs into docs/runs.json, from which docs/validation.md is written; needs no simulation itself.

python benchmarks/validation.py RUN_FOLDER...      # takes their numbers over; then: python -m docs.generate
python benchmarks/validation.py --spin-friction RUN...  # the same for runs of both sets that are shown side by side
python benchmarks/validation.py --cells            # relaxes the cells of both variants: thickness and crimp
python benchmarks/validation.py --commands         # prints the commands of all stored runs, to repeat them
"""

import json
import sys
from pathlib import Path
from typing import Any

import yaml

sys.path.insert(0, str(Path(__file__).parents[1]))
from docs import stored_cells, stored_runs, validation_sets
from docs.stored_runs import StoredRun, inputs_of
from knittest.base.result_rows import unfold_results
from knittest.config.loading import resolve

#: what a preset or an option decides, so that a difference to it is a --set
FREE = ("rig.", "solver.", "model.")


def read(folder: Path) -> StoredRun:
    """The run in ``folder``; raises ``ValueError`` for one that shipped fabrics and ``--set`` cannot repeat."""
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    manifest = json.loads((folder / "manifest.json").read_text(encoding="utf-8"))
    config = yaml.safe_load((folder / "config.yaml").read_text(encoding="utf-8"))
    inputs = inputs_of(config)
    return StoredRun(
        options=_options(config, inputs), inputs=inputs, results=unfold_results(summary["results"]),
        quality=summary["quality"], cost=summary["cost"], refused=summary["refused"], warnings=summary["warnings"],
        commit=manifest["git_commit"], date=manifest["ended"], cpu=manifest["cpu"],
        numerical_error=summary.get("numerical_error", {}),
    )  # fmt: skip


def _options(config: dict[str, Any], inputs: dict[str, Any]) -> dict[str, Any]:
    """Arguments of ``resolve`` that give ``inputs``."""
    rig = config["rig"]
    options = {
        "test": rig["kind"], "variant": config["fabric"]["experiment_variant"], "scale": config["model"]["scale"],
        "preset": config["model"]["preset"], "direction": rig.get("direction") or None,
        "parameters": config["parameters"], "specimens": config["variability"]["specimens"],
    }  # fmt: skip
    plain = inputs_of(resolve(**options).model_dump(mode="json"))
    differing = {path: value for path, value in inputs.items() if plain.get(path) != value}
    strange = [path for path in differing if not path.startswith(FREE)]
    if strange:
        raise ValueError(f"given other numbers than the shipped fabric has now: {', '.join(strange)}")
    return options | {"sets": [f"{path}={value}" for path, value in differing.items()]}


def main(arguments: list[str]) -> None:
    file = stored_runs.FILE
    if arguments[:1] == ["--spin-friction"]:
        file, arguments = validation_sets.FILE, arguments[1:]
    runs = {run.command.removesuffix(" --verify"): run for run in stored_runs.load(file)} if file.exists() else {}
    if arguments == ["--commands"]:
        print("\n".join(run.command for run in runs.values()))
        return
    if arguments == ["--cells"]:
        stored_cells.save({variant: stored_cells.relaxed(variant) for variant in ("1", "2")})
        return
    for folder in map(Path, arguments):
        run = read(folder)
        runs[run.command.removesuffix(" --verify")] = run
    stored_runs.save(list(runs.values()), file)


if __name__ == "__main__":
    main(sys.argv[1:])
