"""Imports point one way, between packages and between the rooms inside them.

Packages are in `MAY_IMPORT`, rooms in the tables of `docs/reference/architecture.md`:
a room imports only rooms that stand above it in its table, and third parties stay in
their layer.
"""

import ast
import re
import sys

import pytest
from support.house import PACKAGES, ROOT

MAY_IMPORT = {
    "rewards": (),
    "envs": ("rewards", "fingers_deploy"),
    "sysid": ("rewards", "envs", "fingers_deploy"),
    "fingers_mjx": ("rewards", "envs", "sysid", "fingers_deploy", "fingers_robot"),
    "fingers_deploy": (),
    "fingers_robot": ("fingers_deploy",),
    "benchmarks": (
        *("rewards", "envs", "sysid"),
        *("fingers_mjx", "fingers_deploy", "fingers_robot"),
    ),
    "deploy/benchmarks": ("envs", "fingers_mjx", "fingers_deploy", "fingers_robot"),
}
OURS = {name for name in MAY_IMPORT if "/" not in name}
ARRAYS = {"jax", "numpy", "jaxtyping", "flax"}
SHIM = {"numpy", "onnxruntime"}
ROBOT = {"numpy", "wujihandpy", "mujoco"}  # mujoco: in its simulator
FOREIGN = {"rewards": ARRAYS, "fingers_deploy": SHIM, "fingers_robot": ROBOT}
"""Third parties of the packages that are used far from a simulator."""

TABLES = (ROOT / "docs/reference/architecture.md").read_text("utf-8")


def imported(source):
    """Yields the full names of all modules that `source` may import."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "relative import"
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def wrong(package, names):
    """Returns the packages of `names` that `package` may not import, sorted."""
    tops = {name.split(".")[0] for name in names} - {package}
    up = tops & OURS - set(MAY_IMPORT[package])
    strangers = tops - OURS - set(sys.stdlib_module_names)
    allowed = FOREIGN.get(package, strangers)
    return sorted(up | (strangers - allowed))


@pytest.mark.parametrize("package", MAY_IMPORT)
def test_packages_import_downwards(package):
    files = sorted(PACKAGES[package].rglob("*.py"))
    assert files
    found = {
        str(file.relative_to(ROOT)): wrong(package, imported(file.read_text("utf-8")))
        for file in files
    }
    assert {file: names for file, names in found.items() if names} == {}


@pytest.mark.parametrize(
    ("package", "source", "found"),
    [
        ("rewards", "def f():\n    from envs.base import State", ["envs"]),
        ("envs", "import fingers_mjx.train", ["fingers_mjx"]),
        ("envs", "import mujoco, rewards", []),
        ("sysid", "from benchmarks.diagnosis import score", ["benchmarks"]),
        ("rewards", "import mujoco", ["mujoco"]),
        ("fingers_deploy", "import jax", ["jax"]),
        ("fingers_deploy", "from fingers_deploy.wire import x", []),
        ("fingers_deploy", "import fingers_robot.reading", ["fingers_robot"]),
        ("fingers_robot", "from fingers_deploy.wire import x", []),
    ],
)
def test_a_wrong_import_is_found(package, source, found):
    """Negative control."""
    assert wrong(package, imported(source)) == found


def tables():
    """The rooms of each folder, lowest first, with what they hold."""
    sections = re.findall(r"^### `([\w/]+)`\n(.*?)(?=^#|\Z)", TABLES, re.M | re.S)
    row = re.compile(r"^\| `(\w+)/?` \| (.+) \|$", re.M)
    return {folder: dict(row.findall(text)) for folder, text in sections}


def rooms(folder):
    """The modules and folders of a folder, by name."""
    paths = [p for p in (ROOT / folder).iterdir() if not p.name.startswith("__")]
    modules = {p.stem: p for p in paths if p.suffix == ".py"}
    return modules | {p.name: p for p in paths if any(p.glob("**/*.py"))}


def summary(path):
    """The first sentence of a room's docstring."""
    file = path / "__init__.py" if path.is_dir() else path
    text = ast.get_docstring(ast.parse(file.read_text("utf-8"))) or ""
    return " ".join(text.split("\n\n")[0].split()).rstrip(".")


def climbing(order, package, room, names):
    """Returns the rooms of `names` that do not stand above `room` in its table."""
    inside = {n.split(".")[package.count(".") + 1] for n in names if f"{package}." in n}
    ours = inside & set(order) - {room}
    return sorted(r for r in ours if order.index(r) > order.index(room))


@pytest.mark.parametrize("folder", tables())
def test_the_table_is_the_folder(folder):
    said = {name: text for name, text in tables()[folder].items()}
    assert said == {name: summary(path) for name, path in rooms(folder).items()}


@pytest.mark.parametrize("folder", tables())
def test_rooms_import_what_stands_above_them(folder):
    order, package = list(tables()[folder]), folder.removeprefix("deploy/")
    package = package.replace("/", ".")
    found = {}
    for room, path in rooms(folder).items():
        for file in sorted(path.rglob("*.py")) if path.is_dir() else [path]:
            names = [
                n
                for n in imported(file.read_text("utf-8"))
                if n.startswith(f"{package}.")
            ]
            if wrong_rooms := climbing(order, package, room, names):
                found[str(file.relative_to(ROOT))] = wrong_rooms
    assert found == {}


def test_every_package_has_its_table():
    assert {folder.removeprefix("deploy/") for folder in tables()} >= OURS


def test_an_import_between_rooms_against_the_order_is_found():
    """Negative control."""
    order = ["logs", "diagnosis", "walking"]
    names = ["sysid.logs.read", "sysid.walking.verdict", "sysid.diagnosis.diagnose"]
    assert climbing(order, "sysid", "diagnosis", names) == ["walking"]
