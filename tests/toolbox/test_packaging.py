"""What others build and read from the checkout (workflows, conda, container, records) says what pyproject.toml says."""

from __future__ import annotations

import ast
import json
import os
import re
import shutil
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from pathlib import Path
from typing import Any

import pytest

from deadwood_algorithms.params.tool import VERSION
from deadwood_toolbox import plugin_zip

yaml = pytest.importorskip("yaml")
ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
DEPENDENCIES = PROJECT["project"]["dependencies"]
OF_CONDA = {"matplotlib": "matplotlib-base"}  # without the windows of Qt
RECIPE = "packaging/conda/recipe.yaml"
WORKFLOWS = sorted((ROOT / ".github" / "workflows").glob("*.yml"))


def read(place: str) -> Any:
    return yaml.safe_load((ROOT / place).read_text(encoding="utf-8"))


def bounds(lines: list[Any]) -> dict[str, str]:
    """Lower bound by name, of ``numpy>=2.0`` and ``numpy >=2.0``."""
    found = (re.fullmatch(r"([\w-]+)\s*>=\s*([\w.]+)", each) for each in lines if isinstance(each, str))
    return {each[1]: each[2] for each in found if each}


def test_every_dependency_has_a_lower_bound_and_a_tested_version():
    """The suite has been run with the lower bounds; constraints.txt has the versions of the last run."""
    tested = dict(
        line.split("==") for line in (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines() if "==" in line
    )
    lower = bounds(DEPENDENCIES)
    assert len(lower) == len(DEPENDENCIES)

    def numbers(version: str) -> list[int]:
        return [int(each) for each in re.findall(r"\d+", version)]

    assert {name for name in lower if numbers(lower[name]) > numbers(tested[name])} == set()


@pytest.mark.parametrize("place", ["environment.yml", RECIPE])
def test_conda_asks_for_the_same_versions(place):
    told = read(place)
    lines = told["dependencies"] if place == "environment.yml" else told["requirements"]["run"]
    found = bounds(lines)
    for name, version in bounds(DEPENDENCIES).items():
        assert found[OF_CONDA.get(name, name)] == version, name
    ours = {OF_CONDA.get(name, name) for name in bounds(DEPENDENCIES)}
    assert set(found) - ours <= {"python"}


def test_the_conda_recipe_is_of_this_version():
    told = read(RECIPE)
    assert told["context"]["version"] == VERSION
    assert f">={told['context']['python_min']}" == PROJECT["project"]["requires-python"]
    scripts = [f"{name} = {place}" for name, place in PROJECT["project"]["scripts"].items()]
    assert told["build"]["python"]["entry_points"] == scripts
    hook = PROJECT["tool"]["hatch"]["build"]["targets"]["wheel"]["hooks"]["custom"]
    built = bounds([*PROJECT["build-system"]["requires"], *hook["dependencies"]])
    assert built.items() <= bounds(told["requirements"]["host"]).items()


def test_codemeta_says_what_is_cited():
    told = json.loads((ROOT / "codemeta.json").read_text(encoding="utf-8"))
    cited = read("CITATION.cff")
    assert told["version"] == cited["version"] == VERSION
    assert told["name"] == cited["title"]
    assert told["description"] == cited["abstract"]
    assert [each["name"] for each in told["author"]] == [each["name"] for each in cited["authors"]]
    assert told["keywords"] == cited["keywords"]
    assert told["license"] == f"https://spdx.org/licenses/{cited['license']}"
    assert told["softwareRequirements"] == DEPENDENCIES


# Name in [project.urls] -> where the records repeat it: file, keys.
RECORDED_URLS = {
    "Repository": (("CITATION.cff", "repository-code"), ("codemeta.json", "codeRepository"), (RECIPE, "repository")),
    "Issues": (("codemeta.json", "issueTracker"),),
    "Homepage": (("CITATION.cff", "url"), ("codemeta.json", "url"), (RECIPE, "homepage")),
}


def disagreeing(urls: dict[str, str], records: dict[str, dict[str, Any]]) -> list[str]:
    """The places that do not repeat the address of [project.urls], or name one that it does not have."""
    return [
        f"{file}: {key}"
        for name, places in RECORDED_URLS.items()
        for file, key in places
        if records[file].get(key) != urls.get(name)
    ]


def test_the_records_have_the_addresses_of_the_package():
    """They are set in [project.urls]; as long as there are none, the records have none either."""
    records = {
        "CITATION.cff": read("CITATION.cff"),
        "codemeta.json": json.loads((ROOT / "codemeta.json").read_text(encoding="utf-8")),
        RECIPE: read(RECIPE)["about"],
    }
    urls = PROJECT["project"].get("urls", {})
    assert disagreeing(urls, records) == []
    assert set(urls) <= set(RECORDED_URLS)
    places = [f"{file}: {key}" for each in RECORDED_URLS.values() for file, key in each]
    assert disagreeing(dict.fromkeys(RECORDED_URLS, "https://example.org"), {name: {} for name in records}) == places


def test_the_paper_for_joss_cites_what_its_bibliography_has():
    text = (ROOT / "packaging" / "joss" / "paper.md").read_text(encoding="utf-8")
    _, head, body = text.split("---\n", 2)
    told = yaml.safe_load(head)
    assert [each["name"] for each in told["authors"]] == [each["name"] for each in read("CITATION.cff")["authors"]]
    bibliography = (ROOT / "packaging" / "joss" / told["bibliography"]).read_text(encoding="utf-8")
    assert set(re.findall(r"@([a-z_]+\d*)", body)) == set(re.findall(r"^@\w+\{(\w+),", bibliography, re.MULTILINE))
    wanted = ("Summary", "Statement of need", "State of the field", "Software design", "References")
    assert set(wanted) <= set(re.findall(r"^# (.+)$", body, re.MULTILINE))
    assert 500 < len(body.split()) < 1750


IN_THE_SOURCES = (".ci", ".github", "algorithms", "benchmarks", "deadwood_toolbox", "docs", "engine", "packaging")
MADE = {"__pycache__", "_build", ".numba_cache", ".work"}  # folders that the checkout ignores
MADE_FILES = ("functions.pyi", ".pyc", ".nbi", ".nbc", ".aux.xml")


def test_the_source_archive_holds_the_checkout_byte_for_byte(tmp_path):
    """So its own tests are those of the checkout."""
    command = [sys.executable, "-m", "hatchling", "build", "--target", "sdist", "--directory", str(tmp_path)]
    ran = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert ran.returncode == 0, ran.stderr
    (archive,) = tmp_path.glob("*.tar.gz")
    here = {each for each in ROOT.iterdir() if each.suffix in (".md", ".toml", ".txt", ".yml", ".json", ".cff")}
    for folder in (*IN_THE_SOURCES, "sample_data", "tests"):
        here |= {each for each in (ROOT / folder).rglob("*") if each.is_file() and not MADE & set(each.parts)}
    with tarfile.open(archive) as held:
        names = {name.partition("/")[2]: name for name in held.getnames()}
        assert not [name for name in names if MADE & set(name.split("/"))]
        for path in sorted(here):
            if path.name.endswith(MADE_FILES):
                continue
            name = path.relative_to(ROOT).as_posix()
            assert name in names, name
            file = held.extractfile(names[name])
            assert file is not None
            assert file.read() == path.read_bytes(), name


def test_the_engine_alone_needs_what_it_imports(tmp_path):
    alone = tomllib.loads((ROOT / "engine" / "pyproject.toml").read_text(encoding="utf-8"))
    needed = bounds(alone["project"]["dependencies"])
    assert needed.items() <= bounds(DEPENDENCIES).items()
    assert alone["project"]["requires-python"] == PROJECT["project"]["requires-python"]
    sources = sorted((ROOT / "engine" / "deadwood_engine").glob("*.py"))
    nodes = [node for each in sources for node in ast.walk(ast.parse(each.read_text(encoding="utf-8")))]
    found = {name.name for node in nodes if isinstance(node, ast.Import) for name in node.names}
    found |= {str(node.module) for node in nodes if isinstance(node, ast.ImportFrom) and not node.level}
    assert {name.split(".")[0] for name in found} - sys.stdlib_module_names == set(needed)
    command = [sys.executable, "-m", "hatchling", "build", "--target", "wheel", "--directory", str(tmp_path)]
    ran = subprocess.run(command, cwd=ROOT / "engine", capture_output=True, text=True)
    assert ran.returncode == 0, ran.stderr
    (wheel,) = tmp_path.glob(f"deadwood_engine-{VERSION}-*.whl")
    with zipfile.ZipFile(wheel) as packed:
        assert {f"deadwood_engine/{each.name}" for each in sources} <= set(packed.namelist())


def test_the_wheel_takes_sample_data_that_exist():
    taken = PROJECT["tool"]["hatch"]["build"]["targets"]["wheel"]["force-include"]
    there = {f"sample_data/{each.name}" for each in (ROOT / "sample_data").iterdir() if each.suffix != ".py"}
    there = {each for each in there if not each.endswith((".aux.xml", "__pycache__"))}
    pictures = {each.relative_to(ROOT).as_posix() for each in plugin_zip.pictures()}  # of the plugin's help pages
    assert len(pictures) > 3
    assert set(taken) == there | pictures
    assert all(inside == f"deadwood_toolbox/{outside}" for outside, inside in taken.items())


def test_the_container_makes_what_the_recipe_needs():
    lines = (ROOT / "packaging" / "Containerfile").read_text(encoding="utf-8").splitlines()
    words = [line.split()[0] for line in lines if line and not line.startswith("#")]
    assert set(words) <= {"FROM", "WORKDIR", "COPY", "RUN", "ENV", "ENTRYPOINT", "CMD"}
    assert words[-2:] == ["ENTRYPOINT", "CMD"]


# --- workflows --------------------------------------------------------------------------------------------------------


def installed(program: str) -> str | None:
    """Where a program is: on the PATH, beside this Python (pip), or where Go installs it."""
    folders = [Path(sys.executable).parent, Path(os.environ.get("GOBIN") or Path.home() / "go" / "bin")]
    return shutil.which(program) or shutil.which(program, path=os.pathsep.join(map(str, folders)))


@pytest.mark.parametrize("path", WORKFLOWS, ids=lambda path: path.name)
def test_actionlint_finds_nothing(path):
    program = installed("actionlint")
    if program is None:
        pytest.skip("actionlint is not installed")
    ran = subprocess.run([program, str(path)], capture_output=True, text=True)
    assert ran.returncode == 0, ran.stdout


def test_the_suite_runs_where_the_package_says_that_it_does():
    jobs = read(".github/workflows/tests.yml")["jobs"]
    matrix = jobs["suite"]["strategy"]["matrix"]
    classified = [
        each.rpartition(" ")[2]
        for each in PROJECT["project"]["classifiers"]
        if re.search(r":: Python :: 3\.\d+$", each)
    ]
    assert matrix["python"] == classified
    assert PROJECT["project"]["requires-python"] == f">={classified[0]}"
    assert {each.partition("-")[0] for each in matrix["system"]} == {"ubuntu", "windows", "macos"}
    lowest = next(step["with"]["python-version"] for step in jobs["lowest"]["steps"] if "with" in step)
    assert lowest == classified[0]


def test_the_workflows_run_what_is_there():
    for path in WORKFLOWS:
        told = yaml.safe_load(path.read_text(encoding="utf-8"))
        assert told["permissions"] == {"contents": "read"}
        for name, job in told["jobs"].items():
            assert job["timeout-minutes"] <= 120, name
            for step in job["steps"]:
                assert ("run" in step) != ("uses" in step), name
                for place in re.findall(r"pytest (tests/\S+)|^(\.ci/\S+)", step.get("run", ""), re.MULTILINE):
                    assert (ROOT / "".join(place)).exists(), place


def test_issue_forms_ask_for_something():
    for path in sorted((ROOT / ".github" / "ISSUE_TEMPLATE").glob("*.yml")):
        told = yaml.safe_load(path.read_text(encoding="utf-8"))
        if path.name == "config.yml":
            continue
        assert {"name", "description", "body"} <= set(told)
        ids = [each["id"] for each in told["body"]]
        assert len(ids) == len(set(ids)) > 0
        assert all(each["attributes"]["label"] for each in told["body"])
