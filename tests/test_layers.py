"""Imports between our packages point one way, and third parties stay in their layer."""

import ast
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
OURS = ("rewards", "envs", "sysid", "fingers_mjx", "fingers_deploy", "fingers_robot")
PACKAGES = {
    "rewards": ROOT / "rewards",
    "envs": ROOT / "envs",
    "sysid": ROOT / "sysid",
    "fingers_mjx": ROOT / "fingers_mjx",
    "fingers_deploy": ROOT / "deploy" / "fingers_deploy",
    "fingers_robot": ROOT / "deploy" / "fingers_robot",
}
MAY_IMPORT = {
    "rewards": (),
    "envs": ("rewards", "fingers_deploy"),
    "sysid": ("rewards", "envs"),
    "fingers_mjx": ("rewards", "envs", "sysid", "fingers_deploy", "fingers_robot"),
    "fingers_deploy": (),
    "fingers_robot": ("fingers_deploy",),
}
ARRAYS = {"jax", "numpy", "jaxtyping", "flax"}
SHIM = {"numpy", "onnxruntime"}
ROBOT = {"numpy", "wujihandpy", "mujoco"}  # mujoco: in its simulator
FOREIGN = {"rewards": ARRAYS, "fingers_deploy": SHIM, "fingers_robot": ROBOT}
"""Third parties of the packages that are used far from a simulator."""


def imports(source):
    """Yields the top-level names of all modules that `source` imports."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            yield from (alias.name.split(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "relative import"
            yield node.module.split(".")[0]


def wrong(package, names):
    """Returns the imports of `names` that `package` may not make, sorted."""
    names = set(names) - {package}
    up = names & set(OURS) - set(MAY_IMPORT[package])
    strangers = names - set(OURS) - set(sys.stdlib_module_names)
    allowed = FOREIGN.get(package, strangers)
    return sorted(up | (strangers - allowed))


@pytest.mark.parametrize("package", OURS)
def test_imports_point_down(package):
    files = sorted(PACKAGES[package].rglob("*.py"))
    assert files
    found = {
        str(file.relative_to(ROOT)): wrong(package, imports(file.read_text("utf-8")))
        for file in files
    }
    assert {file: names for file, names in found.items() if names} == {}


@pytest.mark.parametrize(
    ("package", "source", "found"),
    [
        ("rewards", "def f():\n    from envs.base import State", ["envs"]),
        ("envs", "import fingers_mjx.training.train", ["fingers_mjx"]),
        ("envs", "import mujoco, rewards", []),
        ("rewards", "import mujoco", ["mujoco"]),
        ("fingers_deploy", "import jax", ["jax"]),
        ("fingers_deploy", "from fingers_deploy.wire import x", []),
        ("fingers_deploy", "import fingers_robot.reading", ["fingers_robot"]),
        ("fingers_robot", "from fingers_deploy.wire import x", []),
    ],
)
def test_a_wrong_import_is_found(package, source, found):
    """Negative control of the walk."""
    assert wrong(package, imports(source)) == found
