"""`fingers-deploy check`: what a bundle needs, and whether this machine can run it."""

import argparse
import subprocess
import sys
import time
from typing import Any

import numpy as np

from fingers_deploy.bundle import Bundle, load_bundle
from fingers_deploy.controller import PolicyController
from fingers_deploy.manifest import Interface
from fingers_deploy.observation import input_size
from fingers_deploy.policy import Runtime
from fingers_robot.behaviour.task_inputs import OBJECT_TERMS, reads

STEPS = 2000
SHARE_OF_PERIOD = 0.4
_PROBE = "import onnxruntime; print(onnxruntime.__version__)"


def add_check(commands: Any) -> None:
    """Adds the command."""
    parser = commands.add_parser("check", help="verify a bundle and time it here")
    parser.add_argument("bundle", help="folder or ONNX file")
    parser.set_defaults(command=check)


def check(options: argparse.Namespace) -> int:
    """Loads, verifies, tests and times a bundle; nothing is energized.

    Returns:
        0; 6 if no runtime is fast enough for the control rate.
    """
    bundle = load_bundle(options.bundle)
    _describe(bundle)
    version = onnxruntime_version()
    print(f"ONNX Runtime    {version or 'not usable here'}")
    runtimes: list[Runtime] = ["onnxruntime", "numpy"] if version else ["numpy"]
    allowed_s = SHARE_OF_PERIOD / bundle.manifest.interface.control_rate_hz
    best = min(_time(bundle, runtime, allowed_s) for runtime in runtimes)
    if best > allowed_s:
        print("too slow        no runtime keeps the control rate on this machine")
        return 6
    return 0


def onnxruntime_version() -> str:
    """Version of ONNX Runtime; empty where it is missing or dies when imported.

    It is asked in a process of its own: some of its wheels use instructions that small
    boards do not have, and then end the process.
    """
    done = subprocess.run(
        [sys.executable, "-c", _PROBE], capture_output=True, text=True, check=False
    )
    return done.stdout.strip() if done.returncode == 0 else ""


def _describe(bundle: Bundle) -> None:
    manifest, interface = bundle.manifest, bundle.manifest.interface
    terms = ", ".join(
        f"{t.name}[{t.size}]x{t.history}" for t in interface.observation.terms
    )
    chain = interface.command_path
    print(f"bundle          {bundle.source}")
    print(f"task            {manifest.task}, {interface.control_rate_hz:g} Hz")
    print(f"checksum        right; graph {manifest.policy.sha256[:16]}…")
    print(f"self-test       {len(manifest.parity.obs)} known answers right")
    print(f"observation     {terms}")
    print(f"command         {_ranges(interface.command_ranges)}")
    for option in sources_needed(interface):
        print(f"read from       {option}")
    print(
        f"action          {interface.action.scale_rad:g} rad per step, "
        f"output within ±{interface.action.clip:g}"
    )
    print(
        f"trained with    delay {1e3 * chain.delay_s:g} ms, low-pass "
        f"{chain.lowpass_hz} Hz, joint speed {_speeds(interface.slews_rad_s)}"
    )
    print(f"joints          {', '.join(interface.joint_names)}")


def sources_needed(interface: Interface) -> list[str]:
    """Options of `run` for what a policy reads beside a command."""
    options = {
        ("request",): "--keys or typed `keys …`; key events: --keyboard DEVICE",
        OBJECT_TERMS: "--tracker PATH, a camera's samples",
    }
    return [words for terms, words in options.items() if reads(interface, terms)]


def _speeds(limits_rad_s: tuple[float, ...]) -> str:
    different = sorted(set(limits_rad_s), reverse=True)
    return " or ".join(f"{limit:g}" for limit in different) + " rad/s"


def _ranges(ranges: tuple[tuple[float, float], ...]) -> str:
    return ", ".join(f"[{low:g}, {high:g}]" for low, high in ranges) or "none"


def _time(bundle: Bundle, runtime: Runtime, allowed_s: float) -> float:
    """Times whole steps of the controller; returns the 99.9 % quantile [s].

    It is the time that the processor spends on a step: what else runs on this machine
    now says little about the robot. Real-time priority takes care of the rest.
    """
    controller = PolicyController(bundle, runtime)
    interface = bundle.manifest.interface
    pose, command = interface.reference_angles_rad, np.zeros(input_size(interface))
    took = np.empty(STEPS)
    for i in range(STEPS):
        start = time.thread_time()
        controller.step(pose, (0.0, 0.0, -1.0), (0.0, 0.0, 0.0), command)
        took[i] = time.thread_time() - start
    middle, high = np.quantile(took, (0.5, 0.999))
    words = "fast enough" if high <= allowed_s else "TOO SLOW"
    print(
        f"{runtime:15} {1e3 * middle:.3f} ms of one core per step, 99.9 % within "
        f"{1e3 * high:.3f} ms: {words}"
    )
    return float(high)
