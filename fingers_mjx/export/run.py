"""From a run directory to a bundle that can be evaluated and played anywhere."""

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from envs.batch import BatchEnv
from envs.config.atomic_file import write_atomic
from envs.config.json_file import read_table
from envs.errors import InputError
from fingers_deploy.bundle import POLICY_FILE
from fingers_deploy.manifest import Normalizer, Provenance
from fingers_mjx.evaluation.files import SUMMARY_FILE
from fingers_mjx.export.export import (
    Apply,
    ExportReport,
    brax_apply,
    brax_weights,
    export_policy,
)
from fingers_mjx.export.onnx_graph import PolicyWeights
from fingers_mjx.policy.actor import read, warm_started
from fingers_mjx.policy.interface import check_run_interface, interface_of
from fingers_mjx.policy.place import is_run
from fingers_mjx.ppo.state import make_learner, train_template
from fingers_mjx.runs.checkpoint import Saved
from fingers_mjx.runs.directory import CONFIG_FILE, HAND_FILE, VERSIONS_FILE
from fingers_mjx.runs.setup import (
    Setup,
    config_digest,
    make_env,
    run_setup,
)


@contextmanager
def as_bundle(path: Path | None) -> Iterator[Path | None]:
    """Yields a bundle: `path`, or what a run without one exports, until it is done.

    Args:
        path: of a bundle, or a run; a run into which one was exported is that one.

    Raises:
        InputError: as `export_run`.
    """
    if path is None or not is_run(path) or (path / POLICY_FILE).is_file():
        yield path
        return
    with tempfile.TemporaryDirectory(prefix="fingers-") as folder:
        out = Path(folder) / path.absolute().name
        export_run(path, out)
        yield out


def export_run(run_dir: Path, out_dir: Path) -> ExportReport:
    """Writes the policy of a run's newest checkpoint as a bundle.

    Beside `policy.onnx` and `manifest.json` stand `config.yaml` and `hand.yaml`, from
    which `fingers eval` and `fingers play` build the task again.

    Args:
        run_dir: run directory.
        out_dir: made if missing; may be `run_dir` itself.

    Raises:
        InputError: no run directory of this version, or one without a checkpoint.
        ExportError: the exported graph gives other actions than JAX.
    """
    setup, saved = run_setup(run_dir), read(run_dir)
    env = make_env(setup, 1, "cpu")
    check_run_interface(run_dir, env)
    weights, apply = _network(setup, saved, env)
    report = export_policy(
        out_dir,
        weights,
        apply,
        setup.train.task,
        interface_of(env),
        _provenance(run_dir, saved),
    )
    copy_setup(run_dir, out_dir)
    return report


def copy_setup(source: Path, out_dir: Path) -> None:
    """Puts the settings and the hand of a run or bundle beside another policy."""
    for name in (CONFIG_FILE, HAND_FILE):
        content = (source / name).read_bytes()
        if not (out_dir / name).exists() or (out_dir / name).read_bytes() != content:
            write_atomic(out_dir / name, content)


def _network(setup: Setup, saved: Saved, env: BatchEnv) -> tuple[PolicyWeights, Apply]:
    """Returns the actor's weights, and the actor as training ran it."""
    train = warm_started(train_template(env, setup.train.ppo), saved)
    actor, normalizer = train.params.policy, train.normalizer
    weights = brax_weights(actor, normalizer, setup.env.action_clip)
    network = make_learner(env, setup.train.ppo).networks.policy_network
    return weights, brax_apply(network, normalizer, actor)


def _provenance(run_dir: Path, saved: Saved) -> Provenance:
    steps, count = saved.meta["env_steps"], saved.arrays
    high, low = (int(count[f"train/normalizer/count/{x}"]) for x in ("hi", "lo"))
    return Provenance(
        config_sha256=config_digest(run_dir),
        normalizer=Normalizer(steps=steps, count=(high << 32) + low),
        evaluation=_evaluation(run_dir / "eval" / SUMMARY_FILE, steps),
        versions=_versions(run_dir / VERSIONS_FILE),
    )


def _evaluation(path: Path, steps: int) -> dict[str, float] | None:
    """Returns the means of the run's last evaluation, if it is of this checkpoint."""
    if not path.exists():
        return None
    summary = read_table(path)
    if summary.get("steps_trained") != steps:
        return None
    try:
        means = {name: m["mean"] for name, m in summary["measures"].items()}
    except (LookupError, TypeError, AttributeError) as error:
        raise InputError(path, "measures", error, "what fingers eval writes") from error
    return {name: mean for name, mean in means.items() if mean is not None}


def _versions(path: Path) -> dict[str, str]:
    packages = read_table(path).get("packages")
    if not isinstance(packages, dict):
        raise InputError(path, "packages", packages, "what fingers train writes")
    return packages
