"""The manifest: what a policy reads, what its output means, where it comes from.

A bundle is understood from this alone. The dataclasses are the schema: every field is
required, no other is allowed (`fingers_deploy.strict_json`); `fingers_deploy.checks`
states what must hold between fields.
"""

import dataclasses
import json
import math
from dataclasses import dataclass
from typing import Any

SCHEMA_VERSION = 1
HISTORY_ORDER = "oldest_first_term_major"
ACTION_TRANSFORM = "target += alpha*tanh(clip(a))"


@dataclass(frozen=True)
class PolicyGraph:
    """The ONNX graph.

    Attributes:
        input: name of the input, `obs` of shape [1, obs_size], float32.
        output: name of the output, `action` of shape [1, action_size], float32,
            already clipped to ±`Action.clip`.
        obs_size: number of observation entries.
        action_size: number of actions, one per joint.
        sha256: SHA-256 of the serialized ONNX model without its metadata, hex.
    """

    input: str
    output: str
    obs_size: int
    action_size: int
    sha256: str


@dataclass(frozen=True)
class Term:
    """One observation term.

    Attributes:
        name: where its values come from (`fingers_deploy.checks.TERM_FRAMES`).
        size: entries of one sample.
        frame: frame in which they are expressed.
        unit: their unit before scaling.
        scale: factor applied to every entry.
        history: number of samples kept, one per control step.
    """

    name: str
    size: int
    frame: str
    unit: str
    scale: float
    history: int


@dataclass(frozen=True)
class Observation:
    """The observation: each term's whole history, oldest first, before the next term.

    Attributes:
        terms: the terms in order.
        history_order: always `HISTORY_ORDER`.
    """

    terms: tuple[Term, ...]
    history_order: str = HISTORY_ORDER


@dataclass(frozen=True)
class Action:
    """What the output does: target ← clip(target + alpha·tanh(clip(a)), joint limits).

    The graph clips to ±`clip`; alpha, tanh and the joint limits are applied outside.

    Attributes:
        scale_rad: alpha, the largest change of a target per control step [rad].
        clip: bound on the policy output.
        transform: always `ACTION_TRANSFORM`.
    """

    scale_rad: float
    clip: float
    transform: str = ACTION_TRANSFORM


@dataclass(frozen=True)
class CommandPath:
    """The path from target to servo that the policy was trained with.

    Attributes:
        delay_s: transport delay [s].
        lowpass_hz: cutoff of the command low-pass [Hz], null without one.
        slew_rad_s: limit on the rate of each joint's command [rad/s], null without one;
            one number, in bundles of earlier exports, is the lowest of the joints.
    """

    delay_s: float
    lowpass_hz: float | None
    slew_rad_s: tuple[float, ...] | float | None


@dataclass(frozen=True)
class Interface:
    """Everything between the policy and the hand.

    Attributes:
        joint_names: the joints, in the order of every joint vector.
        reference_angles_rad: subtracted from the joint angles in the observation.
        joint_limits_rad: lowest and highest target of each joint.
        initial_target_rad: target at the start of an episode.
        control_rate_hz: rate at which the policy is called.
        observation: how the observation is put together.
        action: what the output does.
        command_path: delay and filters of the targets in training.
        command_ranges: lowest and highest value of each command entry in training.
        v_quat_b: orientation of the control frame V in the palm frame, unit quaternion
            w x y z; V is level, x forward, in the nominal stance.
    """

    joint_names: tuple[str, ...]
    reference_angles_rad: tuple[float, ...]
    joint_limits_rad: tuple[tuple[float, float], ...]
    initial_target_rad: tuple[float, ...]
    control_rate_hz: float
    observation: Observation
    action: Action
    command_path: CommandPath
    command_ranges: tuple[tuple[float, float], ...]
    v_quat_b: tuple[float, float, float, float]

    @property
    def slews_rad_s(self) -> tuple[float, ...]:
        """Limit of each joint's command [rad/s], infinity without one, [n]."""
        slew = self.command_path.slew_rad_s
        if isinstance(slew, tuple):
            return slew
        return (math.inf if slew is None else slew,) * len(self.joint_names)


@dataclass(frozen=True)
class Normalizer:
    """Where the normalizer inside the graph comes from.

    Attributes:
        steps: environment steps trained when it was taken.
        count: observations it has averaged.
    """

    steps: int
    count: int


@dataclass(frozen=True)
class Provenance:
    """How the policy was made.

    Attributes:
        config_sha256: SHA-256 of the resolved training configuration, hex.
        normalizer: state of the observation normalizer.
        evaluation: summary numbers of an evaluation, null if none was run.
        versions: version of each package that took part.
    """

    config_sha256: str
    normalizer: Normalizer
    evaluation: dict[str, float] | None
    versions: dict[str, str]


@dataclass(frozen=True)
class Parity:
    """Observations with the actions that the trained network gives for them."""

    obs: tuple[tuple[float, ...], ...]
    action: tuple[tuple[float, ...], ...]


@dataclass(frozen=True)
class Manifest:
    """The whole manifest.

    Attributes:
        schema_version: version of this schema, `SCHEMA_VERSION`.
        task: name of the task.
        policy: the graph.
        interface: what the policy reads and what its output means.
        provenance: how it was made.
        parity: known answers, checked at every load.
    """

    schema_version: int
    task: str
    policy: PolicyGraph
    interface: Interface
    provenance: Provenance
    parity: Parity


def dump_manifest(manifest: Manifest) -> str:
    """Writes the manifest as JSON; numbers read back to the same bits.

    What is not finite or has another type is refused by whoever reads the text.
    """
    return _format(dataclasses.asdict(manifest)) + "\n"


def _format(value: Any, indent: str = "") -> str:
    """Formats JSON with one line per field and per row of numbers."""
    deeper = indent + "  "
    if isinstance(value, dict) and value:
        rows = [f"{json.dumps(k)}: {_format(v, deeper)}" for k, v in value.items()]
        return _block("{", rows, "}", indent)
    if isinstance(value, list | tuple) and any(
        isinstance(v, list | tuple | dict) for v in value
    ):
        return _block("[", [_format(v, deeper) for v in value], "]", indent)
    return json.dumps(value)


def _block(opening: str, rows: list[str], closing: str, indent: str) -> str:
    body = ",\n".join(f"{indent}  {row}" for row in rows)
    return f"{opening}\n{body}\n{indent}{closing}"
