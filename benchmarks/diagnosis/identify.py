"""Three parameters from one log: this project's fit and `mujoco.sysid`, in one run.

    python -m benchmarks.diagnosis.identify --seeds 3

A servo with a weight is simulated by C MuJoCo at 8 kHz with its gains and armature
drawn at random, and recorded as a host would: 500 Hz, encoder steps, noise on angle and
effort. Both tools see the same log, know the firmware's low-pass, have the same model
at 1 kHz, start at the same wrong values and search stiffness, damping and armature. The
second needs the optional dependencies of MuJoCo: pip install "mujoco[sysid]"; --step
gives it a finer step, --only ours leaves it out.
"""

import argparse
import contextlib
import io
import json
import logging
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import mujoco
import numpy as np
from scipy.signal import lfilter

from sysid.calibration.record import joint_record
from sysid.calibration.simulation import Motion
from sysid.drive import JointDrive, Nominal
from sysid.least_squares import Task, fit_all
from sysid.logs.log import MeasuredLog, make_log
from sysid.mechanism import model_mechanism

RATE_HZ, STEP_S, FINE_S = 500.0, 0.001, 0.000125
CUTOFF_HZ = 20.0
NAMES = ("stiffness", "damping", "armature")
NOMINAL = np.array([4.0, 0.12, 0.0015])
NOISE = {"pos": 3e-4, "tau": 4e-3}
MJCF = """
<mujoco><option timestep="{step}" integrator="implicitfast">
<flag contact="disable"/></option><worldbody><body name="arm">
<inertial pos="0 0 -0.1" mass="0.15" diaginertia="1e-4 1e-4 1e-4"/>
<joint name="servo" axis="0 1 0" armature="{armature}"
frictionloss="{dry_nm}"/></body></worldbody>
<actuator><position name="servo" joint="servo" kp="{kp}" kv="{kd}"/></actuator>
<sensor><jointpos name="pos" joint="servo"/>
<actuatorfrc name="tau" actuator="servo"/></sensor></mujoco>
"""


def mjcf(values: np.ndarray, step_s: float, dry_nm: float = 0.0) -> str:
    """Writes the model, with dry friction if asked for."""
    kp, kd, armature = values
    return MJCF.format(step=step_s, kp=kp, kd=kd, armature=armature, dry_nm=dry_nm)


def targets(rng: np.random.Generator, rows: int) -> np.ndarray:
    """Steps, a chirp from 0.2 to 8 Hz, and a ramp."""
    t = np.arange(rows) / RATE_HZ
    steps = np.repeat(rng.uniform(-0.6, 0.6, rows // 400 + 1), 400)[:rows]
    chirp = 0.3 * np.sin(2.0 * np.pi * (0.2 + 0.5 * 7.8 * t / t[-1]) * t)
    ramp = 0.5 * np.abs((0.2 * t) % 2.0 - 1.0)
    return np.where(t < t[-1] / 3, steps, np.where(t < t[-1] / 1.5, chirp, ramp))


def lowpass(held: np.ndarray, step_s: float) -> np.ndarray:
    """What the firmware makes of targets that are held during each step.

    Row k is the command when step k begins.
    """
    pole = np.exp(-2.0 * np.pi * CUTOFF_HZ * step_s)
    after, _ = lfilter([1.0 - pole], [1.0, -pole], held, zi=[pole * held[0]])
    return np.append(held[0], after[:-1])


def recorded(
    true: np.ndarray, rng: np.random.Generator, seconds: float, dry_nm: float = 0.0
) -> MeasuredLog:
    """Simulates the truth and writes down what a host sees."""
    rows, every = round(seconds * RATE_HZ), round(1.0 / RATE_HZ / FINE_S)
    model = mujoco.MjModel.from_xml_string(mjcf(true, FINE_S, dry_nm))
    data = mujoco.MjData(model)
    command, seen = targets(rng, rows), np.zeros((rows, 2))
    for step, wanted in enumerate(lowpass(np.repeat(command, every), FINE_S)):
        data.ctrl[0] = wanted
        if step % every == 0:
            mujoco.mj_forward(model, data)
            seen[step // every] = data.sensordata
        mujoco.mj_step(model, data)
    angle = seen[:, 0] + rng.normal(0.0, NOISE["pos"], rows)
    angle = np.round(angle * 16384 / 2 / np.pi) * 2 * np.pi / 16384
    effort = seen[:, 1] + rng.normal(0.0, NOISE["tau"], rows)
    columns = {"cmd.servo": command, "pos.servo": angle, "tau.servo": effort}
    return make_log(("servo",), np.arange(rows) / RATE_HZ, columns)


def ours(log: MeasuredLog, with_friction: bool = False) -> np.ndarray:
    """Fits with this project, dry friction too if asked for."""
    model = mujoco.MjModel.from_xml_string(mjcf(NOMINAL, STEP_S))
    drive = JointDrive(Nominal(NOMINAL[0]), Nominal(NOMINAL[1]))
    record = joint_record(model_mechanism(model, {"servo": drive}), log, "servo")
    motion = Motion([record], (NOMINAL[0], NOMINAL[1]), 1e6)
    motion.scales = [np.array([NOISE["pos"], NOISE["tau"]])]
    # Neither delay nor speed limit, nor viscous friction.
    start = np.concatenate([[0.0, 0.0], np.log([1e-9, CUTOFF_HZ, 1e6]), np.zeros(4)])
    wide, steps = np.full(9, 10.0), np.full(9, 0.01)
    task = Task(
        start,
        np.array([0, 1, 5, *([7] if with_friction else [])]),
        start,
        wide,
        start - wide,
        start + wide,
        steps,
    )
    fit = fit_all(motion.residuals, [task], rounds=30)[0]
    found = np.exp(fit.theta[[0, 1, 5]])
    inertia = float(np.mean(record.neighbours.inertia))
    rest = inertia - NOMINAL[2]
    return np.append(NOMINAL[:2] * found[:2], found[2] * inertia - rest)


def theirs(log: MeasuredLog, step_s: float = STEP_S) -> np.ndarray:
    """Fits with `mujoco.sysid`, its default optimizer."""
    from mujoco import sysid

    spec = mujoco.MjSpec.from_string(mjcf(NOMINAL, step_s))
    model = spec.compile()
    t_s = np.arange(0.0, log.t_s[-1] + step_s / 2, step_s)
    last = np.searchsorted(log.t_s, t_s + 1e-9, "right") - 1
    command = lowpass(log.column("cmd.servo")[last], step_s)
    control = sysid.TimeSeries(t_s, command[:, None])
    seen = np.stack([log.column("pos.servo"), log.column("tau.servo")], 1)
    sensors = sysid.TimeSeries.from_names(log.t_s, seen, model)
    data = mujoco.MjData(model)
    data.qpos[0] = log.column("pos.servo")[0]
    start = sysid.create_initial_state(model, data.qpos, data.qvel, data.act)
    params = sysid.ParameterDict()
    for name, nominal, modifier in zip(NAMES, NOMINAL, _MODIFIERS, strict=True):
        bounds = (0.05 * nominal, 20.0 * nominal)
        params.add(sysid.Parameter(name, nominal, *bounds, modifier=modifier))
    sequences = sysid.ModelSequences("servo", spec, "log", start, control, sensors)
    weights = {name: 1.0 / sigma for name, sigma in NOISE.items()}
    residual = sysid.build_residual_fn(
        models_sequences=[sequences], sensor_weights=weights
    )
    with contextlib.redirect_stdout(io.StringIO()):
        found, _ = sysid.optimize(params, residual, verbose=False)
    return found.as_vector()


def _set_stiffness(spec, parameter) -> None:
    from mujoco import sysid

    sysid.apply_pgain(spec, "servo", parameter.value[0])


def _set_damping(spec, parameter) -> None:
    from mujoco import sysid

    sysid.apply_dgain(spec, "servo", parameter.value[0])


def _set_armature(spec, parameter) -> None:
    spec.joint("servo").armature = parameter.value[0]


_MODIFIERS = (_set_stiffness, _set_damping, _set_armature)


def timed(
    fit: Callable[[MeasuredLog], np.ndarray], log: MeasuredLog, true: np.ndarray
) -> dict[str, float]:
    """Relative errors and the time [s]."""
    began = time.perf_counter()
    found = fit(log)
    seconds = time.perf_counter() - began
    errors = np.abs(found / true - 1.0)
    return {"seconds": seconds} | dict(zip(NAMES, errors.tolist(), strict=True))


def main() -> None:
    """Runs both tools and prints errors, times and their ratio."""
    parser = argparse.ArgumentParser(description="Three parameters from one log")
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--seconds", type=float, default=30.0)
    parser.add_argument("--step", type=float, default=STEP_S)
    parser.add_argument("--only", choices=("ours",))
    parser.add_argument("--json", type=Path, metavar="FILE")
    args = parser.parse_args()
    logging.disable(logging.INFO)
    tools = {"ours": ours, "mujoco.sysid": partial(theirs, step_s=args.step)}
    tools = {"ours": ours} if args.only else tools
    rows = []
    for seed in range(args.seeds):
        rng = np.random.default_rng(seed)
        true = NOMINAL * np.exp(rng.uniform(-0.5, 0.5, 3))
        log = recorded(true, rng, args.seconds)
        for name, fit in tools.items():
            row = {"tool": name, "seed": seed, **timed(fit, log, true)}
            rows.append(row)
            errors = ", ".join(f"{n} {100 * row[n]:.3f} %" for n in NAMES)
            print(f"{name:>12} seed {seed}: {row['seconds']:.2f} s, {errors}")
    result = {"rows": rows, "summary": summary(rows)}
    print("\n".join(f"{name}: {x:.4g}" for name, x in result["summary"].items()))
    if args.json:
        args.json.write_text(json.dumps(result, indent=2), encoding="utf-8")


def summary(rows: list[dict]) -> dict[str, float]:
    """Ratios of times and errors; first runs, which compile, are apart."""

    def of(tool: str, name: str) -> np.ndarray:
        return np.array([row[name] for row in rows if row["tool"] == tool])

    tools = list(dict.fromkeys(row["tool"] for row in rows))
    found = {
        f"largest error of {tool}, mean over logs": float(
            np.mean(np.max([of(tool, name) for name in NAMES], axis=0))
        )
        for tool in tools
    }
    if len(tools) > 1:
        ratio = of(tools[1], "seconds") / of(tools[0], "seconds")
        name = f"time of {tools[1]} / {tools[0]}"
        found[f"{name}, first log (with compilation)"] = float(ratio[0])
        found |= (
            {f"{name}, next logs": float(np.median(ratio[1:]))}
            if ratio[1:].size
            else {}
        )
    return found


if __name__ == "__main__":
    main()
