"""The documentation's site: it builds strictly, and names what exists."""

import importlib.util
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from docs.stage import ROOT, sources

BUILD = [sys.executable, "-m", "mkdocs", "build", "--strict"]
SHOWN = (
    "rewards.lift.lift_step",
    "rewards.tables.crawl.CRAWL",
    "envs.actuator.effect.EffectKind",
    "fingers_mjx.ppo.config.PpoConfig",
    "fingers_mjx.studies.sweep.spec.Sweep",
    "fingers_robot.drivers.protocol.Driver",
)
"""Of a kind each: what a user of the reference would look for."""
API = sorted((ROOT / "docs/api").glob("*.md"))


def build(place):
    """Builds a copy of the pages in `place`; returns the finished process."""
    text = (ROOT / "mkdocs.yml").read_text("utf-8")
    text = text.replace("build/site-pages", "pages").replace("build/site", "site")
    text = text.replace("paths: [., deploy]", f'paths: ["{ROOT}", "{ROOT}/deploy"]')
    (place / "mkdocs.yml").write_text(text, "utf-8")
    quiet = {"NO_MKDOCS_2_WARNING": "1", "JUPYTER_PLATFORM_DIRS": "1"}
    return subprocess.run(
        BUILD, cwd=place, env=os.environ | quiet, capture_output=True, text=True
    )


@pytest.fixture(scope="module")
def staged(tmp_path_factory):
    place = tmp_path_factory.mktemp("site")
    for path in sources():
        (place / "pages" / path).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / path, place / "pages" / path)
    return place


def test_the_site_builds_strictly_and_has_no_dead_links(staged):
    done = build(staged)
    assert done.returncode == 0, done.stderr
    pages = (staged / "site/docs/api").glob("*.html")
    ids = re.findall(r' id="([\w.]+)"', "".join(p.read_text("utf-8") for p in pages))
    assert set(SHOWN) <= set(ids)
    drawn = (staged / "site/notebooks/2_rewards.html").read_text("utf-8")
    assert drawn.count("data:image/png;base64") >= 5
    fetched = [
        f for f in (staged / "site").rglob("*.html") if "fonts.g" in f.read_text()
    ]
    assert fetched == []


@pytest.mark.parametrize("link", ["no-such.md", "../guides/hand.md#no-such"])
def test_a_dead_link_ends_the_build(staged, link):
    """Negative control, of a page and of an anchor."""
    page: Path = staged / "pages/docs/concepts/data-flow.md"
    text = page.read_text("utf-8")
    page.write_text(f"{text}\n[dead]({link})\n", "utf-8")
    done = build(staged)
    page.write_text(text, "utf-8")
    assert done.returncode != 0
    assert link in done.stderr


@pytest.mark.parametrize("path", API, ids=lambda path: path.stem)
def test_the_modules_of_the_reference_exist(path):
    modules = re.findall(r"^::: (\S+)$", path.read_text("utf-8"), re.MULTILINE)
    assert modules
    assert [m for m in modules if importlib.util.find_spec(m) is None] == []


def test_the_files_beside_the_paper_exist():
    text = (ROOT / "docs/concepts/paper-to-code.md").read_text("utf-8")
    files = re.findall(r"`([\w/]+\.py)`", text)
    assert len(files) >= 30
    assert [name for name in files if not (ROOT / name).exists()] == []
