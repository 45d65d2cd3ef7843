"""Time and memory of a control step: observation, network, action, supervisor.

    python deploy/benchmarks/step_time.py --minutes 30

runs the control steps of so many minutes, as fast as possible, on one core.
"""

import argparse
import gc
import json
import os
import sys
import time

import numpy as np
from hand_files import WALKING

from fingers_deploy.bundle import Bundle, load_bundle
from fingers_deploy.controller import PolicyController
from fingers_deploy.policy import Runtime
from fingers_deploy.rotations import conjugate, gravity
from fingers_robot.drivers.stand_in import sound_health
from fingers_robot.reading import ImuReading, Reading
from fingers_robot.runtime.realtime import resident_mb
from fingers_robot.safety import (
    Inputs,
    Mode,
    Operator,
    Proposal,
    initial_state,
    make_limits,
    step,
)
from fingers_robot.safety.detectors.policy import complement

WARM_UP = 2000


def measure(bundle: Bundle, runtime: Runtime, steps: int) -> dict:
    """Times `steps` control steps of a healthy hand that stands."""
    interface = bundle.manifest.interface
    controller = PolicyController(bundle, runtime)
    factory = np.asarray(interface.joint_limits_rad)
    limits = make_limits(bundle.manifest, factory)
    state = initial_state(limits, 0.0, wiggle=())
    rng = np.random.default_rng(0)
    noise = rng.standard_normal((997, 26))
    quat = conjugate(interface.v_quat_b)
    pose = np.asarray(interface.initial_target_rad, np.float64)
    took, memory, proposal, challenge = np.empty(steps), [], None, 0
    gc.collect()
    gc.freeze()
    gc.disable()
    for k in range(-WARM_UP, steps):
        t = (k + WARM_UP) * 0.02
        begin = time.perf_counter()
        n = noise[k % 997]
        # A hand that follows at once.
        pos = (state.target_rad if k > 10 - WARM_UP else pose) + 1e-4 * n[:20]
        reading = Reading(t, pos, 0.1 * n[:20])
        imu = ImuReading(t, quat, 0.01 * n[20:23])
        on = state.mode in (Mode.ARMING, Mode.ACTIVE)
        health = sound_health(t, on, pos)
        operator = Operator.ARM if k == -WARM_UP + 5 else Operator.NONE
        inputs = Inputs(
            reading, imu, health, proposal, True, operator, True, "", 0, k + WARM_UP
        )
        state, out = step(state, inputs, t, limits)
        challenge = out.challenge
        down = gravity(imu.quat_w)
        target = controller.step(reading.pos_rad, down, imu.gyro_b, (0.0, 0.0, 0.0))
        if not out.policy_runs:
            controller.reset(state.target_rad)
            target = controller.target_rad
        proposal = Proposal(k + WARM_UP, complement(challenge), target.astype(float))
        if k >= 0:
            took[k] = time.perf_counter() - begin
        if k >= 0 and k % 1000 == 0:
            memory.append(resident_mb())
    assert state.mode == Mode.ACTIVE, state.faults
    median, high = np.quantile(took, (0.5, 0.999))
    return {
        "runtime": runtime,
        "steps": steps,
        "median_ms": round(1e3 * float(median), 4),
        "p999_ms": round(1e3 * float(high), 4),
        "worst_ms": round(1e3 * float(took.max()), 3),
        "memory_growth_mb": round(max(memory) - memory[0], 3),
        "memory_mb": round(memory[-1], 1),
    }


def main() -> int:
    """Runs the measurement for both runtimes and prints it as JSON."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--bundle", default=WALKING)
    parser.add_argument("--minutes", type=float, default=30.0)
    parser.add_argument("--no-realtime", action="store_true")
    options = parser.parse_args()
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    if not options.no_realtime:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(40))
    bundle = load_bundle(options.bundle)
    steps = round(options.minutes * 3000)
    print(json.dumps([measure(bundle, r, steps) for r in ("onnxruntime", "numpy")]))
    return 0


if __name__ == "__main__":
    sys.exit(main())
