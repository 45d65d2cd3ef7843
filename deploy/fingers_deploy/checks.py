"""What must hold between the fields of a manifest for this package to honour it."""

import math
import re
from typing import Any

from fingers_deploy.errors import BundleError, one_of
from fingers_deploy.manifest import (
    ACTION_TRANSFORM,
    HISTORY_ORDER,
    SCHEMA_VERSION,
    Interface,
    Manifest,
    Term,
)
from fingers_deploy.strict_json import from_json, load_json

# Size, frame and unit of every term that can be put together here. None: free, because
# the caller supplies the command as the manifest describes it; of joints, one each.
TERM_FRAMES: dict[str, tuple[int | None, str | None, str | None]] = {
    "joint_pos": (None, "joint", "rad"),
    "gravity_b": (3, "palm", "1"),
    "angvel_b": (3, "palm", "rad/s"),
    "previous_action": (None, "joint", "1"),
    "command": (None, None, None),
    "request": (4, None, "1"),
    "fingertip_pos": (3, "V", "m"),
    "object_pos": (3, "V", "m"),
    "object_vel": (3, "V", "m/s"),
    "object_to_target": (3, "V", "m"),
}
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
_VERSION = re.compile(r"[A-Za-z0-9.+_-]{1,64}")
_SHA256 = re.compile(r"[0-9a-f]{64}")
_MAX_HISTORY, _MAX_JOINTS = 1000, 100
_UNIT_TOLERANCE = 1e-4
_ROUNDING_RAD = 1e-6  # a target clipped in float32 may lie this far outside


def parse_manifest(text: str | bytes, source: object) -> Manifest:
    """Reads a manifest and refuses one that is malformed or cannot be honoured.

    Args:
        text: the JSON.
        source: name of the file, for messages.

    Raises:
        BundleError: naming the file, the field, what was found and what is valid.
    """
    value, problem = load_json(text, source), _Problems(source)
    _check_version(value, problem)
    manifest: Manifest = from_json(Manifest, value, source)
    _check_head(manifest, problem)
    _check_joints(manifest.interface, problem)
    _check_terms(manifest.interface, problem)
    _check_rates(manifest.interface, problem)
    _check_frame(manifest.interface, problem)
    _check_sizes(manifest, problem)
    _check_provenance(manifest, problem)
    return manifest


class _Problems:
    """Raises the sentence for a requirement that does not hold."""

    def __init__(self, source: object):
        self.source = source

    def unless(self, holds: bool, field: str, found: object, valid: str) -> None:
        if not holds:
            raise BundleError(self.source, field, found, valid)

    def length(self, field: str, found: int, wanted: int) -> None:
        self.unless(found == wanted, field, f"{found} entries", f"{wanted} entries")


def _check_version(value: Any, problem: _Problems) -> None:
    """Comes first: another version may have other fields."""
    if isinstance(value, dict) and "schema_version" in value:
        found = value["schema_version"]
        problem.unless(
            found == SCHEMA_VERSION, "schema_version", found, f"{SCHEMA_VERSION}"
        )


def _check_head(manifest: Manifest, problem: _Problems) -> None:
    policy = manifest.policy
    problem.unless(
        bool(_NAME.fullmatch(manifest.task)), "task", manifest.task, "an identifier"
    )
    problem.unless(policy.input == "obs", "policy.input", policy.input, "obs")
    problem.unless(policy.output == "action", "policy.output", policy.output, "action")
    _check_sha256("policy.sha256", policy.sha256, problem)


def _check_joints(interface: Interface, problem: _Problems) -> None:
    names, limits = interface.joint_names, interface.joint_limits_rad
    field, valid = "interface.joint_names", f"1 to {_MAX_JOINTS} entries"
    known = 1 <= len(names) <= _MAX_JOINTS
    problem.unless(known, field, f"{len(names)} entries", valid)
    for field in ("reference_angles_rad", "joint_limits_rad", "initial_target_rad"):
        count = len(getattr(interface, field))
        problem.length(f"interface.{field}", count, len(names))
    target = interface.initial_target_rad
    for i, name in enumerate(names):
        field = f"interface.joint_names[{i}]"
        problem.unless(bool(_NAME.fullmatch(name)), field, name, "an identifier")
        problem.unless(name not in names[:i], field, f"{name} again", "distinct names")
    for i, (low, high) in enumerate(limits):
        field = f"interface.joint_limits_rad[{i}]"
        problem.unless(low < high, field, [low, high], "lowest before highest")
        field = f"interface.initial_target_rad[{i}]"
        within = f"within the joint limits [{low}, {high}]"
        inside = low - _ROUNDING_RAD <= target[i] <= high + _ROUNDING_RAD
        problem.unless(inside, field, target[i], within)


def _check_terms(interface: Interface, problem: _Problems) -> None:
    observation = interface.observation
    order, names = observation.history_order, [t.name for t in observation.terms]
    field = "interface.observation"
    problem.unless(
        order == HISTORY_ORDER, f"{field}.history_order", order, HISTORY_ORDER
    )
    problem.unless(bool(names), f"{field}.terms", "no term", "at least one term")
    for i, term in enumerate(observation.terms):
        _check_term(f"{field}.terms[{i}]", term, len(interface.joint_names), problem)
        problem.unless(
            term.name not in names[:i],
            f"{field}.terms[{i}].name",
            f"{term.name} again",
            "every term once",
        )
    commands = [t.size for t in observation.terms if t.name == "command"]
    ranges = interface.command_ranges
    problem.length("interface.command_ranges", len(ranges), sum(commands))
    for i, (low, high) in enumerate(ranges):
        where = f"interface.command_ranges[{i}]"
        problem.unless(low <= high, where, [low, high], "lowest before highest")


def _check_term(field: str, term: Term, joints: int, problem: _Problems) -> None:
    known = term.name in TERM_FRAMES
    valid = one_of(TERM_FRAMES, term.name)
    problem.unless(known, f"{field}.name", term.name, valid)
    size, frame, unit = TERM_FRAMES[term.name]
    size = joints if frame == "joint" else size
    problem.unless(
        term.size == size if size else 0 < term.size <= 1000,
        f"{field}.size",
        term.size,
        f"{size or '1 to 1000'}",
    )
    problem.unless(
        frame in (None, term.frame), f"{field}.frame", term.frame, f"{frame}"
    )
    problem.unless(unit in (None, term.unit), f"{field}.unit", term.unit, f"{unit}")
    problem.unless(term.scale != 0, f"{field}.scale", term.scale, "not zero")
    kept = 1 <= term.history <= _MAX_HISTORY
    problem.unless(kept, f"{field}.history", term.history, f"1 to {_MAX_HISTORY}")


def _check_rates(interface: Interface, problem: _Problems) -> None:
    action, path = interface.action, interface.command_path
    positive = {
        "control_rate_hz": interface.control_rate_hz,
        "action.scale_rad": action.scale_rad,
        "action.clip": action.clip,
        "command_path.lowpass_hz": path.lowpass_hz,
    }
    for field, value in positive.items():
        holds = value is None or value > 0
        problem.unless(holds, f"interface.{field}", value, "above zero")
    slews, joints = interface.slews_rad_s, len(interface.joint_names)
    problem.length("interface.command_path.slew_rad_s", len(slews), joints)
    for i, slew in enumerate(slews):
        field = f"interface.command_path.slew_rad_s[{i}]"
        problem.unless(slew > 0, field, slew, "above zero")
    delay, transform = path.delay_s, action.transform
    problem.unless(delay >= 0, "interface.command_path.delay_s", delay, "0 or more")
    field = "interface.action.transform"
    problem.unless(transform == ACTION_TRANSFORM, field, transform, ACTION_TRANSFORM)


def _check_frame(interface: Interface, problem: _Problems) -> None:
    norm = math.hypot(*interface.v_quat_b)
    holds = abs(norm - 1.0) <= _UNIT_TOLERANCE
    field = "interface.v_quat_b"
    problem.unless(holds, field, f"norm {norm:.6g}", "a unit quaternion")


def _check_sizes(manifest: Manifest, problem: _Problems) -> None:
    policy, parity = manifest.policy, manifest.parity
    total = sum(t.size * t.history for t in manifest.interface.observation.terms)
    found = policy.obs_size
    valid = f"{total}, the sum over the observation terms"
    problem.unless(found == total, "policy.obs_size", found, valid)
    found, joints = policy.action_size, len(manifest.interface.joint_names)
    problem.unless(found == joints, "policy.action_size", found, f"{joints}")
    problem.unless(bool(parity.obs), "parity.obs", "no row", "at least one row")
    problem.length("parity.action", len(parity.action), len(parity.obs))
    for i, row in enumerate(parity.obs):
        problem.length(f"parity.obs[{i}]", len(row), policy.obs_size)
    for i, row in enumerate(parity.action):
        problem.length(f"parity.action[{i}]", len(row), policy.action_size)


def _check_provenance(manifest: Manifest, problem: _Problems) -> None:
    provenance = manifest.provenance
    normalizer = provenance.normalizer
    _check_sha256("provenance.config_sha256", provenance.config_sha256, problem)
    for field, value in (("steps", normalizer.steps), ("count", normalizer.count)):
        where = f"provenance.normalizer.{field}"
        problem.unless(value >= 0, where, value, "0 or more")
    for name, version in provenance.versions.items():
        holds = bool(_VERSION.fullmatch(version))
        where = f"provenance.versions.{name}"
        problem.unless(holds, where, version, "a version such as 1.2.3")


def _check_sha256(field: str, found: str, problem: _Problems) -> None:
    holds = bool(_SHA256.fullmatch(found))
    problem.unless(holds, field, found, "64 lower-case hexadecimal digits")
