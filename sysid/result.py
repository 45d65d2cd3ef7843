"""What a diagnosis says, in the form of `diagnosis.json`."""

import json
from dataclasses import asdict, dataclass, field
from typing import Any, Literal

Verdict = Literal["none", "found", "ambiguous", "unexplained", "not_observable"]


@dataclass(frozen=True)
class Estimate:
    """A parameter with its 95 % interval."""

    value: float
    low: float
    high: float
    unit: str


@dataclass(frozen=True)
class Cause:
    """An effect that the measurement has and the simulation lacks.

    Attributes:
        effect: name in the catalogue.
        where: a joint, or `flexion`, `abduction`, `pip`, `dip`, a finger, `all`.
        parameters: estimates by parameter name.
        evidence: log-likelihood gain on held-out data, natural logarithm; see
            docs/reference/diagnosis.md.
        other: the joint that pulls a coupled one; "" for all other effects.
    """

    effect: str
    where: str
    parameters: dict[str, Estimate]
    evidence: float
    other: str = ""


@dataclass(frozen=True)
class Alternative:
    """An effect that could stand in the place of a cause.

    Attributes:
        effect: name in the catalogue.
        score_gap: by how much its log-likelihood gain is smaller.
        distinguishable: whether these records distinguish it from the cause.
        cause: in whose place it would be; "" where there is one cause only.
    """

    effect: str
    score_gap: float
    distinguishable: bool
    cause: str = ""


@dataclass(frozen=True)
class Hypothesis:
    """What may be behind the records of a joint, and how probable it is.

    Attributes:
        joint: its name.
        effects: that the measurement has and the simulation lacks; () for none, null
            for something that none of the fitted sets explains.
        probability: calibrated on hidden cases; see docs/reference/diagnosis.md [1].
    """

    joint: str
    effects: tuple[str, ...] | None
    probability: float


@dataclass(frozen=True)
class Gain:
    """Error on data that no fit saw, before and after the causes are added.

    Attributes:
        heldout_rmse_before, heldout_rmse_after: in `unit`.
        explained_fraction: share of the removable variance (above the noise floor)
            that the causes remove; `low` and `high` bound it at 95 %.
        unit: of the errors.
        noise_floor: error that no model can remove, in `unit`; None if not known.
    """

    heldout_rmse_before: float
    heldout_rmse_after: float
    explained_fraction: float
    low: float
    high: float
    unit: str
    noise_floor: float | None


@dataclass(frozen=True)
class Diagnosis:
    """The verdict on records of one mechanism; see `sysid.diagnosis.diagnose`.

    Attributes:
        verdict: `none` nothing significant; `found` causes by name; `ambiguous` one of
            several that these records do not distinguish; `unexplained` something that
            no effect of the catalogue explains; `not_observable` the records excite
            too little to say.
        causes: in order of gain.
        alternatives: effects in the place of the first cause, nearest first.
        gain: on held-out data; None without causes.
        residual_gains: the same for each residual: `position`, `controller`,
            `mechanics`.
        next_experiment: what to record next, in one sentence; "" if nothing is needed.
        posterior: hypotheses about each joint that are not improbable; a walk has none.
        not_observable: effects that these records could not show at a size that
            matters.
        unexplained: where an error remains that no effect explains.
        warnings: bounds met, poor excitation, unreliable data.
        summary: the verdict in words.
        log_sha256: digests of the records.
        seed: of everything random.
        runtime_s: time taken [s].
    """

    verdict: Verdict
    causes: tuple[Cause, ...]
    alternatives: tuple[Alternative, ...]
    gain: Gain | None
    next_experiment: str
    log_sha256: tuple[str, ...]
    seed: int
    runtime_s: float
    residual_gains: dict[str, Gain] = field(default_factory=dict)
    posterior: tuple[Hypothesis, ...] = ()
    not_observable: tuple[str, ...] = ()
    unexplained: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    summary: str = ""

    def to_dict(self) -> dict[str, Any]:
        """Returns plain data."""
        return asdict(self)

    def to_json(self) -> str:
        """Returns the contents of `diagnosis.json`."""
        return json.dumps(self.to_dict(), indent=2, ensure_ascii=False, allow_nan=False)
