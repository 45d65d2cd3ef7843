"""`fingers doctor`: what is installed, what training will use, and known traps.

It must run where nothing else does, so it imports nothing of ours that a foreign
package could stand in for, and asks JAX for its devices in a process of its own: one
that hangs is known from one that is slow by its time.
"""

from __future__ import annotations

import importlib.util
import json
import os
import platform
import subprocess
import sys
from collections.abc import Iterator, Mapping
from importlib import metadata
from typing import Any, NamedTuple

from fingers_mjx.cli.machine import gpu, installation
from fingers_mjx.cli.machine.installation import UnsupportedInstallation

SICK = 1
"""Exit status where something is wrong."""

OK, NOTE, WRONG = "ok", "note", "WRONG"
PACKAGES = ("jax", "jaxlib", "mujoco", "mujoco-mjx", "brax", "flax", "numpy", "onnx")
EXTRAS = {
    "viz": ("matplotlib", "imageio_ffmpeg", "PIL", "jinja2", "pyarrow"),
    "data": ("pyarrow", "rosbags"),
    "viewer": ("viser", "mjviser", "trimesh"),
    "wandb": ("wandb",),
    "rerun": ("rerun",),
    "ray": ("ray",),
    "hand": ("wujihandpy",),
}
"""What each optional part needs, beside those that a GPU needs (`cuda12`, `cuda13`)."""

PROBE_S = 180.0
"""Time after which JAX counts as hanging [s]."""

_GL = ("", "egl", "glfw", "osmesa", "glx", "wgl", "cgl", "off", "disable", "disabled")
_PROBE = """
import json
from fingers_mjx.cli.machine.jax_ready import prepare_jax
prepare_jax()
import jax
from envs.config.plugins import found, load
from envs.errors import InputError
from envs.physics.backends import cuda_fault, default_backend
cuda = cuda_fault()
broken = []
for group in ("fingers.tasks", "fingers.drivers", "fingers.logs"):
    for name in found(group):
        try:
            load(group, name, object)
        except InputError as error:
            broken.append(str(error))
devices = [f"{d.platform} {d.device_kind}" for d in jax.devices()]
answer = {"devices": devices, "backend": default_backend(), "broken": broken,
          "cuda": cuda}
print("\\n" + json.dumps(answer))
"""
DRAWING = """
import json
from fingers_mjx.pictures.renderer import drawn_by
print("\\n" + json.dumps({"renderer": drawn_by()}))
"""
"""Asks what draws; of its own, since a driver of OpenGL may end its process."""


class Finding(NamedTuple):
    """One line: how it is, and what was found."""

    state: str
    text: str


def add(commands) -> None:
    """Adds the command."""
    from fingers_mjx.cli.arguments import options

    options.command(
        commands,
        "doctor",
        run,
        "look at the installation: versions, devices, known traps",
        "Look at the installation: Python, packages, the devices that JAX sees, the "
        "physics backend that training will get, and known traps. Exit status 1 where "
        "something is wrong.",
        computes=False,
    )


def run(args: Any = None) -> int:
    """Prints what was found, each line as it is known."""
    del args
    sick = False
    for state, text in examined(os.environ):
        sick |= state == WRONG
        print(f"{state:5}  {text}", flush=True)
    return SICK if sick else 0


def examined(environment: Mapping[str, str]) -> Iterator[Finding]:
    """Yields all findings, the quick ones first."""
    places = list(place_findings())
    yield from places
    yield from version_findings()
    yield from environment_findings(environment)
    yield from extra_findings()
    if any(finding.state == WRONG for finding in places):
        yield Finding(NOTE, "devices: not asked, since our packages cannot be imported")
        return
    yield from device_findings(probed(), environment)
    yield renderer_finding(probed(DRAWING, what="renderer"))


def place_findings() -> Iterator[Finding]:
    """Whether our packages are ours."""
    try:
        installation.check_places()
    except UnsupportedInstallation as error:
        yield Finding(WRONG, str(error))
        return
    yield Finding(OK, f"packages: {', '.join(installation.OURS)} are ours")


def version_findings() -> Iterator[Finding]:
    """Whether Python and packages are those that we ask for."""
    python, texts = installation.requirements()
    checks = [lambda: installation.check_python(platform.python_version(), python)]
    checks += [lambda text=text: installation.check_requirement(text) for text in texts]
    wrong = []
    for check in checks:
        try:
            check()
        except UnsupportedInstallation as error:
            wrong.append(Finding(WRONG, str(error)))
    yield from wrong
    found = {name: _version(name) for name in PACKAGES}
    listed = ", ".join(f"{name} {version}" for name, version in found.items())
    yield Finding(OK, f"Python {platform.python_version()}, {listed}")
    if hangs(found["jaxlib"]):
        what = f"jaxlib {found['jaxlib']} deadlocks on the CPU"
        yield Finding(WRONG, f'{what} (pip install "jaxlib!=0.10.*,!=0.11.0")')


def hangs(jaxlib: str) -> bool:
    """Whether a version of jaxlib is known to hang: 0.10.0 to 0.11.0."""
    return jaxlib.startswith("0.10.") or jaxlib == "0.11.0"


def environment_findings(environment: Mapping[str, str]) -> Iterator[Finding]:
    """What variables of the process would change or break."""
    chosen = environment.get("MUJOCO_GL", "")
    if chosen.lower() not in _GL:
        what = f"MUJOCO_GL={chosen}: MuJoCo cannot be imported"
        yield Finding(WRONG, f"{what}; valid: {', '.join(_GL[1:])}, or unset")
    elif chosen:
        yield Finding(OK, f"MUJOCO_GL={chosen}")
    cache = environment.get("FINGERS_COMPILE_CACHE", "")
    if cache == "off":
        yield Finding(NOTE, "compile cache: off, every start compiles anew")
    elif cache and not _can_hold_files(cache):
        yield Finding(WRONG, f"compile cache: {cache} cannot be written")
    else:
        yield Finding(OK, f"compile cache: {cache or 'among the caches of the user'}")


def extra_findings() -> Iterator[Finding]:
    """Which optional parts are there."""
    for extra, modules in EXTRAS.items():
        lacking = [m for m in modules if importlib.util.find_spec(m) is None]
        if lacking:
            what = f"extra {extra}: no {', '.join(lacking)}"
            yield Finding(NOTE, f"{what} ({gpu.install_command(extra)})")
        else:
            yield Finding(OK, f"extra {extra}")


def probed(
    program: str = _PROBE, limit_s: float = PROBE_S, what: str = "JAX"
) -> dict[str, Any] | str:
    """Asks another process, by default for devices, backend and broken packages.

    Args:
        program: prints the answer as JSON on its last line.
        limit_s: time after which it counts as hanging [s].
        what: is asked, for the sentence.

    Returns:
        The answer, or one sentence that says why there is none.
    """
    command = [sys.executable, "-c", program]
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, timeout=limit_s, check=False
        )
    except subprocess.TimeoutExpired:
        return f"{what}: no answer within {limit_s:g} s"
    if done.returncode:
        said = done.stderr.strip().splitlines() or [f"status {done.returncode}"]
        return f"{what}: {said[-1]}"
    return json.loads(done.stdout.splitlines()[-1])


def device_findings(
    answer: dict[str, Any] | str, environment: Mapping[str, str]
) -> Iterator[Finding]:
    """What JAX computes on, and what it leaves idle.

    Args:
        answer: of `probed`.
        environment: variables of the process, by which the CPU can be chosen.
    """
    if isinstance(answer, str):
        yield Finding(WRONG, answer)
        return
    devices = ", ".join(answer["devices"])
    yield Finding(OK, f"devices: {devices} ({os.cpu_count()} CPU threads)")
    yield Finding(OK, f"physics backend of training: {answer['backend']}")
    on_gpu = any("cpu" not in name.lower() for name in answer["devices"])
    if gpu.sees_gpu() and not on_gpu:
        chosen = gpu.chose_cpu(environment)
        reason = "the CPU was chosen by a variable" if chosen else _lacking(answer)
        what = "an NVIDIA GPU is visible that JAX does not use"
        yield Finding(NOTE if chosen else WRONG, f"{what} ({reason})")
    elif on_gpu and answer["backend"] != "warp":
        what = "the physics stays on the CPU, Warp is not installed"
        yield Finding(WRONG, f"{what} ({gpu.install_command()})")
    for sentence in answer["broken"]:
        yield Finding(WRONG, sentence)


def _lacking(answer: dict[str, Any]) -> str:
    """Returns why JAX does not use a GPU: what to install, or what it says of CUDA."""
    said = answer.get("cuda")
    if said is None or not gpu.has_cuda_jax():
        return gpu.install_command()
    return f"its CUDA plugin does not start: {said}"


def renderer_finding(answer: dict[str, Any] | str) -> Finding:
    """What draws pictures and videos.

    Args:
        answer: of `probed`.
    """
    if isinstance(answer, str):
        return Finding(WRONG, answer)
    return Finding(OK, f"renderer of videos: {answer['renderer']}")


def _version(name: str) -> str:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return "missing"


def _can_hold_files(path: str) -> bool:
    """Whether a folder can be written, or made where it is missing."""
    path = os.path.abspath(path)
    while not os.path.exists(path):
        path = os.path.dirname(path)
    return os.path.isdir(path) and os.access(path, os.W_OK)
