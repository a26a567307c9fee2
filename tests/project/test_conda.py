"""The recipe for conda asks for what pyproject.toml asks for, and a program of conda can read it."""

from __future__ import annotations

import re
import tomllib
from typing import Any

import pytest
from committed import ROOT

import bayestouch

RECIPE = ROOT / "packaging" / "conda" / "recipe.yaml"
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
#: Packages of conda-forge with another name than on PyPI. Its matplotlib adds a toolkit of windows, which is not used.
CONDA = {"matplotlib": "matplotlib-base"}


@pytest.fixture(scope="module")
def recipe() -> dict[str, Any]:
    yaml = pytest.importorskip("yaml", reason="PyYAML is not installed (it comes with the extras cluster and docs)")
    read: dict[str, Any] = yaml.safe_load(RECIPE.read_text("utf-8"))
    return read


def bounds(requirements: list[str]) -> dict[str, str]:
    """Lower bound of each package, under its name in conda-forge."""
    split = [re.fullmatch(r"([\w.-]+) ?>=([\d.]+)", each) for each in requirements]
    assert all(split), requirements
    return {CONDA.get(each[1], each[1]): each[2] for each in split if each}


def test_recipe_has_the_requirements_of_the_project(recipe: dict[str, Any]) -> None:
    project = PROJECT["project"]
    wanted = bounds([*project["dependencies"], f"python{project['requires-python']}"])
    assert bounds(recipe["requirements"]["run"]) == wanted
    host = [each for each in recipe["requirements"]["host"] if each != "pip"]
    assert bounds(host) == bounds([*PROJECT["build-system"]["requires"], f"python{project['requires-python']}"])


def test_recipe_has_the_version_and_the_command_of_the_project(recipe: dict[str, Any]) -> None:
    project = PROJECT["project"]
    assert recipe["context"]["version"] == bayestouch.__version__
    assert recipe["build"]["python"]["entry_points"] == [f"{k} = {v}" for k, v in project["scripts"].items()]
    assert recipe["about"]["license"] == project["license"]
    assert recipe["about"]["summary"] == project["description"]


def test_rattler_build_renders_the_recipe() -> None:
    rattler = pytest.importorskip("rattler_build", reason="py-rattler-build is not installed")
    (rendered,) = rattler.Stage0Recipe.from_file(RECIPE).render()
    made = rendered.recipe
    assert (made.package.name, made.package.version) == ("bayestouch", bayestouch.__version__)
    requirements = made.to_dict()["requirements"]["run"]
    assert bounds([str(each) for each in requirements]) == bounds(
        [*PROJECT["project"]["dependencies"], f"python{PROJECT['project']['requires-python']}"]
    )
