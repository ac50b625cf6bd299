"""Treatment of each command of the pages by test_documented.py. A command that is in none of these tables fails it."""

from documented import Do

#: a small strip of yarns, whole yarns wide
STRIP = "--preset quick --direction weft --set rig.width=20 --set rig.gauge_length=20 --no-frames --out {out}"
SHELLS = "--preset quick --no-frames --out {out}"
FRAME = "--preset quick --set rig.max_angle=30 --no-frames --out {out}"
STRIPS = {"runs/tensile-...": "runs/shells"}
RUNS = STRIPS | {"runs/friction-...": "runs/rubbed"}
IMPORT = "--width 50 --gauge-length 200"

#: not of knittest: installing, testing and linting are what .ci/run does
SETUP = (
    "dask scheduler --host 10.0.0.1", "dask worker tcp://10.0.0.1:8786 --nworkers 4 --nthreads 1",
    "python3 -m venv .venv", ".venv/bin/pip install .", ".venv/bin/pip install '.[test]'",
    ".venv/bin/python -m pytest -n 2",
    ".venv/bin/pip install -e '.[dev]'", ".venv/bin/ruff check .", ".venv/bin/ruff format --check .", ".venv/bin/mypy",
    ".venv/bin/lint-imports",
)  # fmt: skip

#: names of commands, without what they need: they must be there
NAMES = (
    "knittest regress", "knittest speed-study", "knittest resume",
    "knittest check", "knittest check forming", "knittest compare",
    "knittest batch", "knittest calibrate",
    "knittest uncertainty", "knittest homogenise", "knittest export", "knittest view", "knittest view RUN",
    "knittest runs NAME",
    "knittest doctor --clear-cache",
)  # fmt: skip

#: in this order, in one folder
COMMANDS: dict[str, Do] = {
    # the three without options, and what they print
    "knittest --help": Do(),
    "knittest --version": Do(),
    "knittest COMMAND --help": Do(given={"COMMAND": "tensile"}),
    "knittest schema": Do(),
    "knittest schema > knittest-run.schema.json": Do(given={" > knittest-run.schema.json": ""}),
    "knittest doctor": Do(),
    "knittest schema rig.width": Do(),
    "knittest runs": Do(),
    "knittest runs --remove --failed --older-than 7d": Do(),
    "knittest demo": Do("--out {out}", planned="tests/cli/test_demo.py runs it"),
    "knittest warmup": Do(planned="compiles all kernels, which the runs below do as they need them"),
    "knittest bench": Do(planned="a minute of full load of all cores"),
    "knittest bench --against PATH": Do(planned="minutes; tests/unit/test_bench_against.py runs it on one small strip"),
    "knittest bench --preset paper": Do(planned="minutes of full load of all cores"),
    # shells: run as they stand, at the smallest preset
    "knittest friction --variant 1 --scale macro --direction warp": Do(
        SHELLS.format(out="runs/rubbed").replace("--no-frames ", "")
    ),
    "knittest view runs/forming-...": Do(given={"runs/forming-...": "runs/rubbed"}),
    "knittest animate runs/forming-... --out forming.gif": Do(
        "--seconds 0.2 --width 320", given={"runs/forming-...": "runs/rubbed"}
    ),
    "knittest cantilever --variant 1 --scale macro --direction warp": Do(SHELLS),
    "knittest cantilever --variant 1 --scale macro --direction warp --set rig.mode=overhang": Do(
        planned="as the one before, which runs, but for its mode, which the regression runs"
    ),
    "knittest picture-frame --variant 1 --scale macro": Do(planned="as the one with --against, which runs"),
    "knittest picture-frame --variant 1 --scale macro --against mine.csv": Do(FRAME.format(out="runs/sheared")),
    "knittest compare RUN --against mine.csv": Do(given={"RUN": "runs/sheared"}),
    "knittest picture-frame --variant cao2008-weave --scale macro --set rig.side=180 --set rig.frame_side=250 "
    "--against cao2008/curves/uml.csv --against cao2008/curves/ut.csv "
    "--against cao2008/curves/kul1.csv": Do("--preset quick --set rig.max_angle=20 --no-frames --out {out}"),
    "knittest bias-extension --variant 1 --scale macro": Do(
        "--preset quick --set rig.max_angle=12 --set rig.width=40 --set rig.gauge_length=80 --set solver.speed=0.07 "
        "--no-frames --out {out}"
    ),
    "knittest biaxial --variant 1 --scale macro --direction warp --ratio 0.5": Do(SHELLS),
    "knittest cell --variant 1 --path shear": Do("--preset quick --set rig.max_angle=10 --no-frames --out {out}"),
    "knittest cell --variant acrylic-jersey --path weft --preset quick --set rig.max_strain=90 "
    "--set rig.max_force=0.22": Do("--set rig.max_strain=12 --no-frames --out {out}"),
    "knittest cell --variant 1 --path steps.csv": Do(planned="tests/unit/test_cell_path.py reads such a file"),
    "knittest data import bias-*.csv --test bias-extension --gauge-length 230 --width 115 --out data/mine": Do(
        given={"data/mine": "data/pulled"}
    ),
    "knittest data import biaxial-*.csv --test biaxial --direction warp --ratio 0.5 --width 80 --gauge-length 80 "
    "--out data/mine": Do(given={"data/mine": "data/pulled"}),
    "knittest forming --variant 1 --scale macro --blank-holder-force 100": Do(
        planned="40 CPU seconds at preset quick, as which the regression runs it; less deep, it is refused"
    ),
    "knittest export stl --variant 1 --set rig.blank_holder_force=100 --out tools": Do(),
    "knittest export stl --variant 1 --set rig.stamp.t.bar_length=140 --set rig.blank_holder_force=100": Do(
        "--out {out}"
    ),
    "knittest export stl --variant 1": Do("--set rig.stamp.kind=hemisphere --out {out}"),
    "knittest export deck tensile --variant 1 --scale macro --direction warp": Do("--out {out}"),
    "knittest export deck tensile --variant 2 --scale meso --preset quick --direction warp": Do(
        "--set rig.width=12 --set rig.gauge_length=12 --out {out}"
    ),
    "knittest export deck picture-frame --variant 1 --scale macro": Do("--out {out}"),
    "knittest export deck forming --variant 1 --scale macro --set rig.blank_holder_force=100 --out blank": Do(
        "--preset quick --set rig.stamp.kind=hemisphere"
    ),
    "knittest export deck picture-frame --variant 1 --scale macro --format abaqus": Do("--out {out}"),
    "knittest export deck picture-frame --variant 1 --scale macro --format openradioss": Do("--out {out}"),
    "knittest export deck tensile --variant 1 --scale macro --direction warp --format openradioss": Do("--out {out}"),
    "knittest compare RUN --against deck/tensile-warpT01": Do(given={"RUN": "runs/shells/warp"}),
    "knittest tensile --variant 1 --scale macro --preset quick --direction warp --verify": Do(
        "--threads 1 --out {out}"
    ),
    "knittest check friction --variant 2 --scale macro --convergence": Do("--preset quick --direction warp"),
    "knittest check ... --convergence": Do(
        planned="as the one before", given={"...": "tensile --variant 1 --scale macro --direction warp"}
    ),
    "knittest check TEST --convergence": Do(planned="as the one before", given={"TEST": "tensile --variant 1"}),
    # yarns: a strip and a frame of 20 mm
    "knittest tensile --variant 2 --scale meso": Do(STRIP),
    "knittest tensile --variant 2 --scale meso --preset paper --direction weft": Do(
        planned="7 CPU minutes; as the one before but for its size"
    ),
    "knittest check tensile --variant 2 --scale meso --preset paper": Do("--preset quick"),
    "knittest check forming --variant 1 --blank-holder-force 100 --no-time": Do("--preset quick --out {out}"),
    "knittest friction --variant 1 --scale meso --direction warp": Do(
        planned="half a CPU minute; test_friction_meso.py runs one"
    ),
    "knittest picture-frame --variant 1 --scale meso --preset standard --set rig.max_angle=50 --out runs/frame": Do(
        "--preset quick --set rig.side=20 --set rig.max_angle=20"
    ),
    "knittest export tubes runs/tensile-.../warp --out broken.vtp": Do(given={"runs/tensile-.../warp": "runs/frame"}),
    "knittest export tubes runs/tensile-.../warp --out broken.stl": Do(given={"runs/tensile-.../warp": "runs/frame"}),
    "knittest data shear-law runs/frame --out data/law/shear.csv": Do(),
    "knittest data shear-law runs/picture-frame-1-meso --out data/law/shear.csv": Do(
        given={"runs/picture-frame-1-meso": "runs/frame", "data/law/shear": "data/law/third"}
    ),
    "knittest fabric relax --variant 1": Do(),
    "knittest fabric relax --variant acrylic-jersey": Do(),
    "knittest fabric show --variant 2 --out variant2.png": Do(),
    "knittest fabric export --variant 1 loops.vtu --wales 8": Do(),
    # files of a laboratory, fabrics of one's own
    "knittest data stats warp-*.csv --gauge-length 200": Do(),
    "knittest data import warp-*.csv --width 50 --gauge-length 200 --direction warp --out data/mine": Do(),
    "knittest data import warp-*.csv --direction warp --out data/mine": Do(given={"data/mine": "data/other"}),
    "knittest data import weft-*.csv --direction weft --out data/mine": Do(),
    "knittest data import friction-*.csv --test friction --direction warp --normal-force 2000 --plate-length 150 "
    "--plate-width 50 --out data/mine": Do(),
    "knittest data import cantilever-warp.csv --test cantilever --direction warp --area-mass 830 --width 50 "
    "--out data/mine": Do(),
    "knittest data import frame-*.csv --test picture-frame --frame-side 200 --fabric-side 180 --out data/mine": Do(),
    "knittest data import pulls-*.csv --test pull-out --direction weft --embedded-length 50 --crossing-density 28 "
    "--clamped sides --out data/mine": Do(given={"data/mine": "data/pulled"}),
    "knittest data import cycled-*.csv --test picture-frame --frame-side 200 --fabric-side 160 --out data/mine": Do(
        given={"data/mine": "data/pulled"}
    ),
    "knittest new NAME": Do(given={"NAME": "mine-too"}),
    "knittest new my-fabric": Do(),
    "knittest new my-weft --structure weft-only": Do(),
    "knittest fabric show --variant my-weft": Do("--out weft.png"),
    "knittest cell --variant NAME --preset quick --path warp --set rig.max_strain=1.5 --set rig.transverse=held "
    "--set rig.at_fracture=ends": Do("--no-frames --no-pictures --out {out}", given={"NAME": "two-yarns"}),
    "knittest tensile --variant my-fabric --scale macro": Do(SHELLS),
    "knittest check tensile --variant my-fabric --scale macro": Do("--preset quick"),
    "knittest new my-fabric --from data/my-fabric": Do(
        given={"new my-fabric": "new tested", "data/my-fabric": "data/mine"}
    ),
    'knittest new glass-grid --reinforcing "E-glass 600 tex" --knitting "polyester 2 x 34 tex"': Do(),
    "knittest check tensile --variant glass-grid --preset quick --no-time": Do("--set rig.width=20"),
    "knittest tensile --variant glass-grid --preset quick --direction weft --set rig.width=20 "
    "--set rig.gauge_length=20": Do("--no-frames --out {out}"),
    "knittest compare RUN --against FILE": Do(given={"RUN": "runs/shells/weft", "FILE": "example.csv"}),
    "knittest compare runs/tensile-.../warp --against mean.csv --width 50 --direction warp": Do(given=STRIPS),
    # pages and going on
    "knittest resume runs/tensile-...": Do(given=STRIPS),
    "knittest tensile --resume runs/tensile-...": Do(given=STRIPS),
    "knittest report runs/tensile-...": Do(given=STRIPS),
    "knittest export xlsx runs/tensile-...": Do(given=STRIPS),
    "knittest report runs/tensile-... --format svg,pdf --dpi 300": Do(given=STRIPS),
    "knittest report runs/tensile-... runs/friction-...": Do(given=RUNS),
    "knittest report runs/tensile-... runs/friction-... --out comparison.html": Do(given=RUNS),
    "knittest report RUN RUN ...": Do(given={"RUN RUN ...": "runs/shells/warp runs/shells/weft"}),
    "knittest report FOLDER": Do(given={"FOLDER": "runs/shells"}),
    "knittest report SWEEP/trials/KEY SWEEP/trials/KEY": Do(
        given={"SWEEP/trials/KEY SWEEP/trials/KEY": "runs/shells/warp runs/shells/weft"}
    ),
    # studies of many runs: planned to the first
    "knittest batch configs/sweeps/speed-window.yaml --workers 2": Do(planned="half a minute, 42 runs"),
    "knittest batch configs/sweeps/blank-holder.yaml --workers 2": Do(planned="5 CPU minutes"),
    "knittest batch configs/sweeps/yarn-friction.yaml": Do(planned="10 CPU minutes"),
    "knittest picture-frame --variant 1 --set rig.cycles=1 --set rig.max_angle=20": Do(
        planned="2 CPU minutes; test_cycles.py has its evaluation"
    ),
    "knittest pull-out --variant 1 --direction weft": Do(
        "--preset quick --set rig.length=15 --set rig.travel=4.2 --set solver.speed=0.5 --no-frames --out {out}"
    ),
    "knittest compaction --variant 1": Do(planned="half a CPU minute; test_identify.py presses two yarns"),
    "knittest calibrate configs/calibrations/v1-pull-out-yarns.yaml": Do(
        planned="3 CPU minutes; own-fabric.md's is run"
    ),
    "knittest calibrate configs/calibrations/v1-friction.yaml": Do(
        planned="minutes; own-fabric.md's calibration is run"
    ),
    "knittest calibrate configs/calibrations/v1-warp-bending.yaml": Do(planned="minutes; own-fabric.md's is run"),
    "knittest uncertainty configs/uncertainty/shear-order.yaml --workers 4": Do(
        planned="CPU hours; test_uncertainty_command.py runs a small one"
    ),
    "knittest homogenise --variant 1 --from cell --coupled": Do(
        planned="2 CPU minutes; test_homogenise_cell.py has it"
    ),
    "knittest homogenise --variant 1 --from cell": Do(planned="CPU minute; test_homogenise_cell.py has the rest"),
    "knittest homogenise --variant 1": Do(planned="2 CPU minutes; test_homogenise_command.py has the rest"),
    "knittest speed-study --variant 1 --preset quick --out runs/speed-study": Do(planned="10 CPU minutes"),
    "knittest speed-study --variant 2 --test friction --scale macro": Do("--preset quick --out {out}"),
    "knittest regress --level quick --junit regress.xml": Do(planned="2 CPU minutes; .ci/run runs it"),
    "knittest regress --level full --junit regress.xml": Do(planned="CPU hours"),
    "knittest regress --level full --table 4": Do(planned="CPU hours"),
    "knittest regress --table 3 --scale macro --json": Do(planned="1 CPU minute; .ci/run runs its like"),
    "knittest regress --level full --update-baseline": Do("--baseline own.json", planned="CPU hours"),
    "knittest regress --update-baseline": Do("--baseline own.json", planned="2 CPU minutes"),
    "knittest batch SWEEP.yaml --slurm 3 --out /shared/sweep": Do(
        "--out {out}", given={"SWEEP.yaml": "configs/sweeps/blank-holder.yaml"}
    ),
    "knittest batch SWEEP.yaml --dask tcp://10.0.0.1:8786 --out /shared/sweep": Do(
        planned="needs a cluster; test_dask.py has one", given={"SWEEP.yaml": "configs/sweeps/blank-holder.yaml"}
    ),
}
