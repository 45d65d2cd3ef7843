"""Examples in docstrings and on the pages of the API give what they say."""

import doctest
import importlib
from pathlib import Path
from types import ModuleType

import pytest
from support import house

API = sorted((house.ROOT / "docs" / "api").glob("*.md"))
OPTIONS = doctest.NORMALIZE_WHITESPACE
PROMPT = ">>> "


def module_name(file):
    parts = file.relative_to(house.ROOT).with_suffix("").parts
    package = parts[1:] if parts[0] == "deploy" else parts
    return ".".join(package[:-1] if package[-1] == "__init__" else package)


WITH_EXAMPLES = {
    module_name(file): file.read_text("utf-8").count(PROMPT)
    for package in house.PACKAGES
    for file in house.files(package)
    if PROMPT in file.read_text("utf-8")
}
"""Lines with a prompt by module; the others are not imported."""


def run(module):
    return doctest.testmod(module, optionflags=OPTIONS)


@pytest.mark.parametrize("name", WITH_EXAMPLES)
def test_examples_of_docstrings_give_what_they_say(name):
    failed, attempted = run(importlib.import_module(name))
    assert failed == 0
    # doctest passes over what it does not take for the module's own.
    assert attempted == WITH_EXAMPLES[name]


def test_every_library_has_examples():
    packages = {name.partition(".")[0] for name in WITH_EXAMPLES}
    assert packages >= {"rewards", "envs", "sysid", "fingers_mjx"}
    assert sum(WITH_EXAMPLES.values()) >= 80


@pytest.mark.parametrize(
    "page", [p for p in API if PROMPT in p.read_text("utf-8")], ids=lambda p: p.stem
)
def test_examples_of_api_pages_give_what_they_say(page):
    failed, attempted = doctest.testfile(
        str(page), module_relative=False, optionflags=OPTIONS
    )
    assert failed == 0 and attempted > 0


@pytest.mark.parametrize(("said", "failures"), [("2", 0), ("3", 1)])
def test_a_wrong_example_would_be_seen(said, failures):
    """Negative control, with the right answer beside it."""
    module = ModuleType("two", f">>> 1 + 1\n{said}\n")
    assert run(module) == (failures, 1)


def test_module_names_are_those_of_imports():
    deployed = Path(house.ROOT / "deploy/fingers_deploy/policy.py")
    assert module_name(deployed) == "fingers_deploy.policy"
    assert module_name(house.ROOT / "rewards/__init__.py") == "rewards"
