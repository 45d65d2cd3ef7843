"""What documents, images and notebooks install is there under that name."""

import importlib.util
import re
import runpy
import shlex
import subprocess
import tomllib
from pathlib import Path

import pytest
import yaml

from fingers_mjx.cli.main import make_parser

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
EXTRAS = set(PROJECT["project"]["optional-dependencies"])
GROUPS = set(PROJECT["dependency-groups"])
IMAGES = sorted(ROOT.glob("docker/*.Dockerfile"))
DOCUMENTS = sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md")])
NOTEBOOKS = sorted(ROOT.glob("notebooks/[0-9]*.py"))
TEXTS = [*IMAGES, *DOCUMENTS, *NOTEBOOKS, ROOT / "Makefile"]
TEXTS.append(ROOT / ".pre-commit-config.yaml")
UNPUBLISHED = re.compile(
    r"pip install [^\n`]*(?<!\S)[\"']?fingers-(mjx|deploy)(?! @)\b"
)
"""By name alone, which no package index knows; `name @ address` is found."""


def name(path):
    return str(path.relative_to(ROOT))


def extras(text):
    """The extras of ours that a text installs."""
    syncs = "\n".join(re.findall(r"\bsync .*", text.replace("\\\n", " ")))
    options = re.findall(r"--extra[ =](\w+)", syncs)
    arguments = re.findall(r"\bEXTRA=(\w+)", text)
    lists = re.findall(r"(?:[\"' ]\.|fingers.mjx\S*)\[([\w,]+)\]", text)
    return {*options, *arguments, *",".join(lists).split(",")} - {""}


def relative_links(text):
    """The links and pictures of a text that need files beside it."""
    return [to for to in re.findall(r"\]\(([^)]+)\)", text) if "://" not in to]


def groups(text):
    """The groups of dependencies that a text installs or leaves out."""
    return set(re.findall(r"--(?:no-|only-)?group[ =](\w+)", text))


@pytest.mark.parametrize("path", TEXTS, ids=name)
def test_extras_and_groups_exist(path):
    text = path.read_text("utf-8")
    assert extras(text) - EXTRAS == set() and groups(text) - GROUPS == set()


@pytest.mark.parametrize("path", TEXTS, ids=name)
def test_nothing_is_installed_from_where_it_is_not(path):
    assert UNPUBLISHED.search(path.read_text("utf-8")) is None


def test_hooks_run_what_make_format_runs_and_need_no_uv():
    text = (ROOT / ".pre-commit-config.yaml").read_text("utf-8")
    hooks = [hook for repo in yaml.safe_load(text)["repos"] for hook in repo["hooks"]]
    made = re.search(
        r"^format: .*\n((?:\t.*\n)+)", (ROOT / "Makefile").read_text(), re.M
    )
    assert made
    wanted = [
        line.strip().removeprefix("$(RUN) ").removesuffix(" .")
        for line in made[1].splitlines()
    ]
    assert [hook["entry"] for hook in hooks] == [f".venv/bin/{x}" for x in wanted]


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("pip install fingers-deploy", set()),
        ('pip install "fingers-mjx[viz,no]"', {"viz", "no"}),
        ("pip install -q fingers-mjx[no]", {"no"}),
    ],
)
def test_what_does_not_exist_would_be_seen(text, found):
    """Negative control."""
    assert extras(text) == found and UNPUBLISHED.search(text)
    assert extras("uv sync --extra a # EXTRA=b") == {"a", "b"}
    assert extras('pip install ./deploy ".[c]" "fingers-mjx[d] @ e"') == {"c", "d"}
    assert groups("uv sync --group a --no-group b") == {"a", "b"}
    assert not UNPUBLISHED.search('pip install "fingers-deploy @ a" ./deploy')


@pytest.mark.parametrize("folder", [ROOT, ROOT / "deploy"], ids=["all", "deploy"])
def test_what_a_package_index_shows_leads_nowhere_else(folder):
    """An index has no files beside the description, so relative links are dead."""
    project = tomllib.loads((folder / "pyproject.toml").read_text("utf-8"))["project"]
    text = (folder / project["readme"]).read_text("utf-8")
    assert len(text) > 1000 and relative_links(text) == []
    assert relative_links((ROOT / "README.md").read_text("utf-8"))  # would be seen


@pytest.mark.parametrize("path", IMAGES, ids=name)
def test_images_hold_what_is_locked_and_no_group(path):
    """`--no-dev` would leave the group of the documentation in them."""
    text = path.read_text("utf-8").replace("\\\n", " ")
    (command,) = re.findall(r"^RUN uv (sync .*)$", text, re.MULTILINE)
    assert {"--locked", "--no-default-groups"} <= set(command.split())
    assert groups(command) == set()
    assert extras(text) >= {"viz", "data", "viewer"}


def test_commands_of_containers_are_ours():
    texts = [path.read_text("utf-8") for path in [*IMAGES, *DOCUMENTS]]
    found = re.findall(r"^(?:# )?docker run .* (fingers.*)$", "\n".join(texts), re.M)
    for line in found:
        make_parser().parse_args(shlex.split(line)[1:])
    assert len(found) >= 6


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=name)
def test_a_notebook_alone_asks_for_an_address(monkeypatch, tmp_path, notebook):
    """As in Colab, where nothing of ours is and no index has it."""
    cells = re.split(r"^# %%.*\n", notebook.read_text("utf-8"), flags=re.MULTILINE)
    (cell,) = [cell for cell in cells if "pip" in cell and "subprocess.run" in cell]
    (tmp_path / "cell.py").write_text(cell, "utf-8")
    asked = []
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    monkeypatch.setattr(subprocess, "run", lambda argv, check: asked.extend(argv))
    monkeypatch.delenv("FINGERS_PACKAGE", raising=False)
    with pytest.raises(AssertionError, match="address of a repository"):
        runpy.run_path(str(tmp_path / "cell.py"))
    monkeypatch.setenv("FINGERS_PACKAGE", "git+https://a/b")
    runpy.run_path(str(tmp_path / "cell.py"))
    assert asked[-2:] == [
        "fingers-deploy @ git+https://a/b#subdirectory=deploy",
        "fingers-mjx[viz] @ git+https://a/b",
    ]


def test_what_is_locked_for_every_python_fits_its_jax():
    """Flax before 0.12.12 asks JAX for what 0.11 no longer has, without saying so."""
    packages = tomllib.loads((ROOT / "uv.lock").read_text("utf-8"))["package"]
    locked = {
        (package["version"], needed.get("version"))
        for package in packages
        if package["name"] == "flax"
        for needed in package["dependencies"]
        if needed["name"] == "jax"
    }
    newer = [flax for flax, jax in locked if version(jax) >= (0, 11)]
    assert newer and len(locked) > len(newer)  # Python 3.12, and 3.11
    assert all(version(flax) >= (0, 12, 12) for flax in newer)


def version(text):
    """Its numbers."""
    return tuple(map(int, text.split(".")))
