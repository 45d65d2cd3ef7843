"""Table I of the paper from logs: stiffness, friction, delay, speed and cutoff.

    found = calibrate([read_log("index.csv")], hand_mechanism())
    hand = calibrated_hand(load_hand_file(), found)

Joints are fitted one by one (`sysid.calibration.joint`); what all joints share is the
mean of theirs, weighed by their intervals, and its interval is at least as wide as
they scatter. Records of loaded pulls (`sysid.calibration.friction`) give the friction.
"""

import dataclasses
import hashlib
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.stats import t as student

from envs.errors import InputError, one_of
from envs.hand.hand_file import HandFile
from envs.hand.quantity import JointQuantity, Quantity
from sysid.calibration.friction import Pull, is_pull, pull_of
from sysid.calibration.joint import JointFit, fit_joint
from sysid.logs.log import MeasuredLog
from sysid.mechanism import Mechanism, check_two_gains
from sysid.result import Estimate

_PULL = ("source", "finger", "normal_n", "friction", "deviation", "start_s", "stop_s")


@dataclass(frozen=True, eq=False)
class Calibration:
    """What a calibration found.

    Attributes:
        joints: fits by joint.
        pulls: loaded pulls of fingertips.
        shared: `delay_s`, `lowpass_hz`, `speed_flexion`, `speed_abduction`,
            `tip_friction`, as far as the records show them.
        log_sha256: digests of the records.
    """

    joints: dict[str, JointFit]
    pulls: tuple[Pull, ...]
    shared: dict[str, Estimate]
    log_sha256: tuple[str, ...]

    @property
    def digest(self) -> str:
        """One digest for all records."""
        if len(self.log_sha256) == 1:
            return self.log_sha256[0]
        return hashlib.sha256("".join(self.log_sha256).encode()).hexdigest()

    def to_json(self) -> str:
        """Returns all parameters with their intervals."""
        joints = {
            joint: {"rms": f.rms}
            | {n: [f.values[n], f.low[n], f.high[n]] for n in f.low}
            for joint, f in self.joints.items()
        }
        data = {
            "shared": {k: dataclasses.asdict(v) for k, v in self.shared.items()},
            "joints": joints,
            "pulls": [{n: getattr(p, n) for n in _PULL} for p in self.pulls],
            "log_sha256": list(self.log_sha256),
        }
        return json.dumps(_without_nan(data), indent=2, allow_nan=False)


def calibrate(
    logs: Sequence[MeasuredLog],
    mechanism: Mechanism,
    report: Callable[[str], object] = lambda text: None,
) -> Calibration:
    """Calibrates all joints that the records move, and the friction of the tips.

    Args:
        logs: records on a stand; those with a setting `normal_n` are loaded pulls.
        mechanism: the simulation as it stands.
        report: is called with what is being done.

    Raises:
        InputError: records that cannot be used, of joints that the mechanism lacks, or
            that move nothing; or a drive with a velocity loop.
    """
    check_two_gains(mechanism, "a calibration")
    moving = [log for log in logs if not is_pull(log)]
    pulls = tuple(pull_of(log) for log in logs if is_pull(log))
    fits = {}
    _check_joints(moving, mechanism)
    for joint in dict.fromkeys(j for log in moving for j in log.header.joints):
        chosen = [log for log in moving if _moves(log, joint)]
        if chosen:
            report(f"fitting {joint}")
            fits[joint] = fit_joint(mechanism, chosen, joint)
    if not fits and not pulls:
        source = logs[0].source if logs else "logs"
        raise InputError(source, "", "nothing that moves", "joints that move, or pulls")
    digests = tuple(log.sha256 for log in logs)
    return Calibration(fits, pulls, _shared(mechanism, fits, pulls), digests)


def _check_joints(logs: Sequence[MeasuredLog], mechanism: Mechanism) -> None:
    """Refuses a record of a joint that is not in the simulation."""
    for log in logs:
        for joint in log.header.joints:
            if joint not in mechanism.joints:
                valid = one_of(mechanism.joints, joint)
                raise InputError(log.source, "joints", joint, valid)


def _moves(log: MeasuredLog, joint: str) -> bool:
    """Whether the log moves a joint by more than a hundredth of a radian."""
    name = f"cmd.{joint}"
    return name in log.columns and float(np.ptp(log.samples(name)[1])) > 0.01


def _shared(mechanism: Mechanism, fits, pulls) -> dict[str, Estimate]:
    """Parameters that joints share."""
    abduction = set(mechanism.classes.get("abduction", ()))
    groups = {
        "delay_s": ("delay_s", "s", list(fits.values())),
        "lowpass_hz": ("lowpass_hz", "Hz", list(fits.values())),
        "speed_flexion": (
            "speed_limit",
            "rad/s",
            [f for j, f in fits.items() if j not in abduction],
        ),
        "speed_abduction": (
            "speed_limit",
            "rad/s",
            [f for j, f in fits.items() if j in abduction],
        ),
    }
    found = {}
    for name, (parameter, unit, chosen) in groups.items():
        seen = [f for f in chosen if np.isfinite(f.low[parameter])]
        if seen:
            values = np.array([f.values[parameter] for f in seen])
            spread = np.array([max(f.deviation(parameter), 1e-12) for f in seen])
            found[name] = weighed_mean(values, spread, unit)
    if pulls:
        values = np.array([pull.friction for pull in pulls])
        spread = np.array([pull.deviation for pull in pulls])
        found["tip_friction"] = weighed_mean(values, spread, "1")
    return found


def weighed_mean(
    values: Float[np.ndarray, " k"], deviation: Float[np.ndarray, " k"], unit: str
) -> Estimate:
    """x̄ = Σ w_i x_i / Σ w_i with w_i = 1 / (s_i² + τ²), and its 95 % interval.

    τ² is the scatter between the values that their own deviations do not explain. Where
    there is any, the interval takes Student's t for few values.

    Args:
        values: x_i [m, rad, s, 1, …], all of one unit.
        deviation: standard errors s_i > 0 in that unit.
        unit: its name.

    Source:
        R. DerSimonian, N. Laird, "Meta-Analysis in Clinical Trials", Controlled
        Clinical Trials 7(3), 1986.
    """
    count = len(values)
    weight = deviation**-2.0
    mean = np.sum(weight * values) / np.sum(weight)
    excess = np.sum(weight * (values - mean) ** 2) - (count - 1)
    scale = np.sum(weight) - np.sum(weight**2) / np.sum(weight)
    between = max(excess / scale, 0.0) if count > 1 else 0.0
    weight = 1.0 / (deviation**2 + between)
    mean = float(np.sum(weight * values) / np.sum(weight))
    wide = float(student.ppf(0.975, count - 1)) if between > 0.0 else 1.96
    half = wide / float(np.sqrt(np.sum(weight)))
    return Estimate(mean, mean - half, mean + half, unit)


def calibrated_hand(hand: HandFile, found: Calibration) -> HandFile:
    """Returns a hand file with what was found; the rest stays as it was.

    Joints that were not measured keep stiffness, damping and speed.
    """
    source = f"identified from {found.digest}"
    names, changes = hand.nominal.joint_names, {}
    gains = {"stiffness_scale": "stiffness", "damping_scale": "damping"}
    fits = {j: f for j, f in found.joints.items() if j in names}
    for field, parameter in gains.items():
        if fits:
            old = getattr(hand, field)
            changes[field] = _per_joint(old, names, fits, parameter, source, True)
    if fits:
        speed = _per_joint(hand.speed_limit, names, fits, "speed_limit", source, False)
        changes["speed_limit"] = speed
    for name in ("delay_s", "lowpass_hz", "tip_friction"):
        if name in found.shared:
            e, note = found.shared[name], "mean over what was measured"
            unit = getattr(hand, name).unit
            changes[name] = Quantity(e.value, unit, source, e.low, e.high, note)
    return dataclasses.replace(hand, **changes)


def _per_joint(
    old: JointQuantity, names, fits, parameter: str, source: str, factor: bool
) -> JointQuantity:
    """A parameter of all joints, of which some were measured."""
    was = old.per_joint(names)
    value, low, high = (dict(zip(names, was.tolist(), strict=True)) for _ in range(3))
    measured = []
    for joint, fit in fits.items():
        if np.isfinite(fit.low[parameter]):
            scale = float(was[names.index(joint)]) if factor else 1.0
            value[joint] = scale * fit.values[parameter]
            low[joint], high[joint] = (
                scale * fit.low[parameter],
                scale * fit.high[parameter],
            )
            measured.append(joint)
    if not measured:
        return old
    rest = len(names) - len(measured)
    kept = f"; the other {rest} as before ({old.source})" * bool(rest)
    note = f"measured: {', '.join(measured)}{kept}"
    return JointQuantity(value, old.unit, source, low, high, note)


def _without_nan(data):
    """Returns plain data in which what is not known is None."""
    if isinstance(data, dict):
        return {key: _without_nan(value) for key, value in data.items()}
    if isinstance(data, list | tuple):
        return [_without_nan(value) for value in data]
    return None if isinstance(data, float) and not np.isfinite(data) else data
