"""Where a policy is kept: a run directory or a bundle, and what it was trained with."""

from collections.abc import Sequence
from pathlib import Path

from envs.config.strict_yaml import MAX_YAML_BYTES, parse_yaml
from envs.errors import InputError
from fingers_deploy.files import read_regular
from fingers_mjx.runs.directory import CONFIG_FILE, RUN_FILE
from fingers_mjx.runs.members import MEMBERS
from fingers_mjx.runs.settings import Settings, load_settings, overridden, run_settings


def is_run(path: Path) -> bool:
    """Whether `path` is a run directory, of whichever version."""
    return (path / RUN_FILE).is_file()


def is_bundle(path: Path) -> bool:
    """Whether `path` is a bundle; one that was exported into its run is the run."""
    return path.suffix == ".onnx" or (_has_policy(path) and not is_run(path))


def check_run(path: Path) -> None:
    """Raises InputError if `path` is no run directory."""
    if not is_run(path):
        found = "a directory without a run" if path.is_dir() else "no directory"
        valid = _members_of(path) or "a directory made by fingers train"
        raise InputError(path, "", found, valid)


def check_kind(path: Path) -> None:
    """Raises InputError if `path` can be neither a bundle nor a run."""
    from fingers_deploy.bundle import POLICY_FILE

    valid = f"a run directory, a directory with {POLICY_FILE}, or an exported ONNX file"
    if not path.exists():
        raise InputError(path, "", "no such file or directory", valid)
    if path.is_dir() and not (_has_policy(path) or is_run(path)):
        found = f"a directory without {POLICY_FILE}"
        raise InputError(path, "", found, _members_of(path) or valid)


def check_policy(path: Path, assignments: Sequence[str]) -> None:
    """Refuses what is no policy, and settings with which it cannot be measured.

    Before JAX loads; the policy itself is read later, and checked then.

    Args:
        path: run directory, bundle directory or the bundle's ONNX file.
        assignments: of `--set`, for the task.

    Raises:
        InputError: naming the path, or the setting.
    """
    check_kind(path)
    check_policy_settings(assignments)
    if assignments:
        overridden(saved_settings(path), assignments)


def check_policy_settings(assignments: Sequence[str]) -> None:
    """Refuses settings of the learner, which an evaluation has no use for.

    Raises:
        InputError: naming the first one.
    """
    for text in assignments:
        if not text.startswith("env."):
            valid = "a setting of the task, env.FIELD=VALUE"
            raise InputError("--set", "", text, valid)


def saved_settings(path: Path) -> Settings:
    """Reads the settings with which a policy was trained.

    Args:
        path: run directory, bundle directory or the bundle's ONNX file.

    Raises:
        InputError: neither of them, or a `config.yaml` that cannot be read.
    """
    if is_run(path):
        return run_settings(path)
    check_kind(path)
    file = (path if path.is_dir() else path.parent) / CONFIG_FILE
    data = parse_yaml(read_regular(file, MAX_YAML_BYTES).decode("utf-8"), file)
    train = data.get("train") if isinstance(data, dict) else None
    task = train.get("task") if isinstance(train, dict) else None
    if not isinstance(task, str):
        raise InputError(file, "train.task", task, "the name of a task")
    return load_settings(file, task)


def _members_of(path: Path) -> str:
    """Names the run directories of a population, empty if it is none."""
    directory = path / MEMBERS
    return f"one of its members, {directory / '00'} …" if directory.is_dir() else ""


def _has_policy(path: Path) -> bool:
    from fingers_deploy.bundle import POLICY_FILE

    return (path / POLICY_FILE).is_file()
