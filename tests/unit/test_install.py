"""Ways to install knittest: wheel, container and conda recipe state what pyproject.toml states; names of files."""

import re
import tomllib
from pathlib import Path

import jinja2
import yaml

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
DOCKERFILE = (ROOT / "Dockerfile").read_text(encoding="utf-8")
#: names of packages that conda calls otherwise
CONDA_NAMES = {"matplotlib": "matplotlib-base"}
#: names that Windows keeps for devices
DEVICES = {"con", "prn", "aux", "nul", *(f"{name}{n}" for name in ("com", "lpt") for n in range(1, 10))}


def requirement(text: str) -> tuple[str, str]:
    """Name as conda writes it, and bounds."""
    name, bounds = re.fullmatch(r"([\w.-]+)\s*([<>=].*)", text).groups()
    return CONDA_NAMES.get(name.lower(), name.lower()), bounds


def test_the_recipe_for_conda_has_version_and_dependencies_of_the_project():
    text = (ROOT / "recipe/meta.yaml").read_text(encoding="utf-8")
    recipe = yaml.safe_load(jinja2.Template(text, undefined=jinja2.StrictUndefined).render(PYTHON="python"))
    project = PROJECT["project"]
    assert recipe["package"] == {"name": project["name"], "version": project["version"]}
    python = ("python", project["requires-python"])
    assert list(map(requirement, recipe["requirements"]["run"])) == [python, *map(requirement, project["dependencies"])]
    (backend,) = map(requirement, PROJECT["build-system"]["requires"])
    assert {python, backend} <= set(
        map(requirement, recipe["requirements"]["host"][:1] + recipe["requirements"]["host"][2:])
    )
    assert recipe["build"]["entry_points"] == [f"{k} = {v}" for k, v in project["scripts"].items()]
    assert recipe["about"]["license"] == project["license"] and (ROOT / recipe["about"]["license_file"]).is_file()


def test_a_container_has_what_the_wheel_is_built_of_and_runs_without_rights():
    rules = [line for line in (ROOT / ".dockerignore").read_text().splitlines() if line and line[0] != "#"]
    assert rules[0] == "*"
    sent = {line[1:] for line in rules if line[0] == "!"}
    wheel = PROJECT["tool"]["hatch"]["build"]["targets"]["wheel"]
    needed = {"pyproject.toml", PROJECT["project"]["readme"], *PROJECT["project"]["license-files"]}
    assert sent == needed | {*wheel["packages"], *wheel["force-include"]}
    assert all((ROOT / name).exists() for name in sent)
    stages = re.findall(r"^FROM (\S+)", DOCKERFILE, re.M)
    (version,) = {re.fullmatch(r"python:([\d.]+)-slim", image)[1] for image in stages}
    assert f"Programming Language :: Python :: {version}" in PROJECT["project"]["classifiers"]
    steps = re.findall(r"^[A-Z]+ .*", DOCKERFILE, re.M)
    assert steps.index("USER knittest") < steps.index("RUN knittest warmup")
    assert re.findall(r"^USER (\S+)", DOCKERFILE, re.M) == ["knittest"]


def test_pythons_of_ci_are_those_of_the_project():
    classified = {one.rpartition(" ")[2] for one in PROJECT["project"]["classifiers"] if ":: Python :: 3." in one}
    (listed,) = re.findall(r"for version in ([\d. ]+);", (ROOT / ".ci/run").read_text(encoding="utf-8"))
    assert set(listed.split()) == classified
    assert PROJECT["project"]["requires-python"] == f">={min(classified)}"


def test_names_of_files_are_possible_on_windows():
    folders = ("benchmarks", "configs", "data", "docs", "knittest", "recipe", "tests")
    paths = [path.relative_to(ROOT) for name in folders for path in (ROOT / name).rglob("*")]
    parts = {part for path in paths for part in path.parts}
    assert [part for part in parts if re.search(r'[<>:"\\|?*\x00-\x1f]|[. ]$', part)] == [] and len(parts) > 500
    assert [part for part in parts if part.partition(".")[0].lower() in DEVICES] == []
    assert len({str(path).lower() for path in paths}) == len(paths)
