"""Which effects a plan can show, and which it distinguishes, from the model itself.

Every effect is simulated at a small size on the plan's own targets. With the change y
of the record, in deviations of its noise, and the changes S that nominal parameters
make when they move by their tolerances,

    seen(y)     = min_s ‖y − S s‖² + ‖s‖²
    apart(a, b) = min_{s,c} ‖y_a − c y_b − S s‖² + ‖s‖²

half of which is the log-likelihood gain [nat] that the effect is there, and that it is
a and not b at any size c. It grows with the square of the size, which gives the
smallest size that shows, and what could stand for an effect that is barely clear.
Nothing is looked up: another plan, load or gain gives other numbers.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from envs.actuator.catalogue import CATALOGUE
from envs.actuator.effect import EffectKind
from sysid.drive import JointDrive
from sysid.excitation.bench import JointBench, joint_bench
from sysid.excitation.check import STEP_S
from sysid.excitation.plan import Plan
from sysid.mechanism import Mechanism, check_two_gains

NEEDED_NAT = 6.0
"""Log-likelihood gain from which on an effect counts as seen, or as distinguished."""

NO_LIMIT = 1e6
"""Stands for infinity in parameters whose effect vanishes there."""

CLEAR_NAT = 100.0
"""Largest gain of an effect at the size at which alternatives are compared with it."""


@dataclass(frozen=True)
class Noise:
    """What readings scatter by [rad], [N·m]; an infinite effort is not logged."""

    angle_rad: float = 1e-3
    torque_nm: float = 5e-3


@dataclass(frozen=True, eq=False)
class Separation:
    """What a plan shows of one joint.

    Attributes:
        joint: its name.
        effects: names in order.
        sizes: parameters of each effect: as simulated so far, and as tried.
        seen_nat: evidence that it is there.
        apart_nat: evidence for the effect of the row against that of the column, where
            the first is so large that its own evidence is at most `CLEAR_NAT`.
    """

    joint: str
    effects: tuple[str, ...]
    sizes: Mapping[str, Mapping[str, tuple[float, float]]]
    seen_nat: Float[np.ndarray, " e"]
    apart_nat: Float[np.ndarray, "e e"]

    @property
    def seen(self) -> tuple[str, ...]:
        """Effects that show at the size tried."""
        pairs = zip(self.effects, self.seen_nat, strict=True)
        return tuple(name for name, nat in pairs if nat >= NEEDED_NAT)

    @property
    def smallest(self) -> dict[str, float]:
        """Size that just shows as share of the one tried, infinite for none."""
        with np.errstate(divide="ignore"):
            shares = np.sqrt(NEEDED_NAT / self.seen_nat)
        return dict(zip(self.effects, map(float, shares), strict=True))

    def confused(self, effect: str) -> tuple[str, ...]:
        """Returns the effects that could stand for this one."""
        row = self.apart_nat[self.effects.index(effect)]
        pairs = zip(self.effects, row, strict=True)
        seen = self.seen
        return tuple(
            n for n, nat in pairs if n != effect and nat < NEEDED_NAT and n in seen
        )


def separation(
    mechanism: Mechanism, plan: Plan, joint: str, noise: Noise | None = None
) -> Separation:
    """Computes what a plan shows of one of its joints.

    Args:
        mechanism: the simulation as it stands.
        plan: the plan.
        joint: a joint that it moves.
        noise: of the log that will be written.

    Raises:
        InputError: a drive with a velocity loop.
    """
    check_two_gains(mechanism, "a plan")
    noise, drive = noise or Noise(), mechanism.drives[joint]
    bench = joint_bench(mechanism, plan, joint)
    kinds = _kinds(drive)
    rest, sizes = _base(drive, kinds), _sizes(drive, kinds, bench)
    nominals = _perturbed(drive, rest)
    candidates = [rest, *nominals, *sizes.values()]
    scale = np.array([noise.angle_rad, noise.torque_nm])
    flat = (bench.simulate(candidates) / scale).reshape(len(candidates), -1)
    changes = np.nan_to_num(flat - flat[0], posinf=0.0, neginf=0.0)
    return _compared(joint, changes[1 : 1 + len(nominals)], changes, sizes, rest)


def _compared(joint, nominals, changes, sizes, rest) -> Separation:
    """Projects the nominal parameters out and compares the rest."""
    names = tuple(sizes)
    signs = changes[1 + len(nominals) :]
    gram = np.linalg.inv(nominals @ nominals.T + np.eye(len(nominals)))

    def inner(a, b):
        """Inner product orthogonal to what nominal parameters explain."""
        return a @ b.T - (a @ nominals.T) @ gram @ (nominals @ b.T)

    products = inner(signs, signs)
    own = np.maximum(np.diag(products), 0.0)
    across = products**2 / np.maximum(own[None, :], 1e-12)
    apart = 0.5 * np.maximum(own[:, None] - across, 0.0)
    tried = {
        name: {
            key: (float(rest[name][key]), float(value))
            for key, value in candidate[name].items()
            if value != rest[name][key]
        }
        for name, candidate in sizes.items()
    }
    apart *= np.minimum(1.0, CLEAR_NAT / np.maximum(0.5 * own, 1e-12))[:, None]
    return Separation(joint, names, tried, 0.5 * own, apart)


def _kinds(drive: JointDrive) -> dict[str, EffectKind]:
    """Effects that a single joint shows; those of the drive come along."""
    names = [name for name, kind in CATALOGUE.items() if _local(kind)]
    return {name: CATALOGUE[name] for name in (*names, *drive.effects)}


def _local(kind: EffectKind) -> bool:
    """Whether one joint shows it; that a whole finger is weak, it cannot know."""
    return bool(kind.acts) and kind.name != "finger_weakness"


def _base(drive: JointDrive, kinds) -> dict[str, dict[str, float]]:
    """Parameters of all effects in the simulation as it stands."""
    base = {name: kind.identity() for name, kind in kinds.items()}
    for name, values in drive.effects.items():
        base[name] |= {key: known.value for key, known in values.items()}
    for values in base.values():
        values |= {k: NO_LIMIT for k, v in values.items() if np.isinf(v)}
    return base


def _sizes(drive: JointDrive, kinds, bench: JointBench) -> dict[str, dict]:
    """All effects one by one, each at a size that such a joint may have."""
    rest = _base(drive, kinds)
    speed = np.max(np.abs(np.diff(bench.targets))) / bench.repeat / STEP_S
    torque = max(np.max(np.abs(bench.weight)), 0.01 * bench.kp)
    sizes = {}
    for name, kind in kinds.items():
        values = dict(rest[name])
        for key, parameter in kind.parameters.items():
            center, spread = parameter.prior.center, parameter.prior.spread
            if parameter.identity is None:
                values[key] = center
            elif np.isinf(parameter.identity):
                top = {"rad/s": speed, "N·m": 5.0 * torque}.get(parameter.unit, center)
                values[key] = 0.8 * min(rest[name][key], top)
            elif parameter.unit == "N·m":
                values[key] = 0.1 * torque
            elif parameter.prior.kind == "lognormal" and parameter.identity == 0.0:
                values[key] = rest[name][key] + center
            elif parameter.prior.kind == "lognormal":
                values[key] = rest[name][key] * min(spread, 1.2)
            else:
                values[key] = rest[name][key] + spread
        sizes[name] = {**rest, name: values}
    return sizes


def _perturbed(drive: JointDrive, rest) -> list[dict]:
    """The simulation with one nominal parameter off by its tolerance."""
    nominals = []
    gains = {"stiffness": drive.kp, "damping": drive.kd}
    for name, known in gains.items():
        if name in rest:
            scale = {"scale": rest[name]["scale"] * (1.0 + known.tolerance)}
            nominals.append({**rest, name: scale})
    for name, values in drive.effects.items():
        for key, known in values.items():
            off = {**rest[name], key: known.value * (1.0 + known.tolerance)}
            nominals.append({**rest, name: off})
    return nominals
