"""What a policy was trained in, read before JAX loads.

Run directory or bundle must be whole; whether the policy still fits the environment is
checked when `policy.source` reads it.
"""

from pathlib import Path

from envs.errors import InputError
from fingers_deploy import Bundle, load_bundle
from fingers_deploy.bundle import check_joint_order
from fingers_mjx.policy.place import check_kind, is_run
from fingers_mjx.runs.directory import CONFIG_FILE, HAND_FILE
from fingers_mjx.runs.intact import newest_at
from fingers_mjx.runs.setup import Setup, config_digest, load_setup, run_setup


def trained_in(path: Path) -> Setup:
    """Reads settings and hand of a policy.

    Args:
        path: run directory, bundle directory or the bundle's ONNX file.

    Raises:
        InputError: neither of them, a run without an intact checkpoint, or as
            `read_bundle`.
        BundleError: a bundle that is damaged or made for another hand.
    """
    if not is_run(path):
        return read_bundle(path)[1]
    setup = run_setup(path)
    newest_at(path, print)
    return setup


def read_bundle(path: Path) -> tuple[Bundle, Setup]:
    """Reads a bundle with the settings and the hand that were exported with it.

    Args:
        path: bundle directory or the bundle's ONNX file.

    Raises:
        InputError: no bundle; files beside it that are missing or not those of its
            export.
        BundleError: a bundle that is damaged or made for another hand.
    """
    check_kind(path)
    bundle = load_bundle(path)
    directory = path if path.is_dir() else path.parent
    found = config_digest(directory)
    wanted = bundle.manifest.provenance.config_sha256
    if found != wanted:
        what = f"{CONFIG_FILE} and {HAND_FILE}"
        valid = f"the files of this policy's export (SHA-256 {wanted[:12]}…)"
        raise InputError(directory, what, f"SHA-256 {found[:12]}…", valid)
    task = bundle.manifest.task
    setup = load_setup(directory / CONFIG_FILE, directory / HAND_FILE, task)
    check_joint_order(bundle, setup.hand.nominal.joint_names)
    return bundle, setup
