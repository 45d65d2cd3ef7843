"""X5: what is installed on the robot is fixed to the bit, and little."""

import re
import tomllib
from pathlib import Path

from packaging.requirements import Requirement

DEPLOY = Path(__file__).parents[1]
LINE = re.compile(
    r"([a-z0-9_.-]+)==([0-9][0-9.a-z]*)((?: --hash=sha256:[0-9a-f]{64})+)"
)


def locked():
    """Returns version of each package; every line must have hashes."""
    text = (DEPLOY / "robot.txt").read_text().replace("\\\n    ", "")
    found = [LINE.fullmatch(line) for line in text.splitlines()]
    assert found and all(found)
    return {match[1]: match[2] for match in found if match}


def test_the_robot_gets_six_packages_at_most_each_with_its_hashes():
    versions = locked()
    assert len(versions) <= 6
    assert {"numpy", "onnxruntime", "wujihandpy"} <= set(versions)


def test_the_locked_versions_are_those_that_the_package_allows():
    project = tomllib.loads((DEPLOY / "pyproject.toml").read_text())["project"]
    extras = project["optional-dependencies"]
    wanted = [*project["dependencies"], *extras["onnx"], *extras["hand"]]
    versions = locked()
    for requirement in map(Requirement, wanted):
        assert requirement.specifier.contains(versions[requirement.name])
    (onnx,) = map(Requirement, extras["onnx"])
    assert not onnx.specifier.contains("1.21.0")  # dies on the robot's processor


def test_the_bounds_of_the_robot_are_its_own():
    lines = (DEPLOY / "robot-limits.txt").read_text().splitlines()
    limits = [Requirement(line) for line in lines if not line.startswith("#")]
    versions = locked()
    assert limits
    assert all(limit.specifier.contains(versions[limit.name]) for limit in limits)
    root = (DEPLOY.parent / "uv.lock").read_text()
    training = {p["name"]: p["version"] for p in tomllib.loads(root)["package"]}
    assert not limits[0].specifier.contains(training[limits[0].name])
