"""Every function that reads a file of the user, and every command with its words."""

from collections.abc import Callable, Sequence
from pathlib import Path

from benchmarks.inputs.originals import BUNDLE

Read = Callable[[Path], object]


def readers() -> dict[str, tuple[str, Read]]:
    """By name: the kind of file that a function reads, and the function."""
    from envs.config.typed import load_yaml
    from envs.hand.hand_file import load_hand_file
    from envs.hand.importing.files import check_files
    from fingers_deploy.bundle import load_bundle
    from fingers_mjx.evaluation.files import read_table
    from fingers_mjx.runs.directory import saved_bound
    from fingers_mjx.runs.metrics import last_row, read_metrics
    from fingers_mjx.runs.setup import load_setup
    from fingers_mjx.studies.sweep.spec import Sweep
    from fingers_robot.behaviour.plan import read_plan
    from fingers_robot.record import read_log as read_recording
    from fingers_robot.simulator.hand import load_model
    from sysid.logs.bag import BagMap
    from sysid.logs.read import read_log
    from sysid.mechanism import DriveFile

    interface = load_bundle(BUNDLE).manifest.interface
    return {
        "hand file": ("hand", load_hand_file),
        "settings": ("config", lambda p: load_setup(p, p.with_name("hand"), "crawl")),
        "run": ("run.json", lambda path: saved_bound(path.parent)),
        "learning curve": ("metrics", read_metrics),
        "end of a learning curve": ("metrics", last_row),
        "episodes": ("table", read_table),
        "CSV log": ("csv", read_log),
        "Parquet log": ("parquet", read_log),
        "bag": ("recording", read_log),
        "map of topics": ("drive", lambda path: load_yaml(BagMap, path)),
        "drive": ("drive", lambda path: load_yaml(DriveFile, path)),
        "MJCF": ("mjcf", check_files),
        "sweep": ("sweep", lambda path: load_yaml(Sweep, path)),
        "policy": ("onnx", load_bundle),
        "manifest": ("manifest", lambda path: load_bundle(path.parent)),
        "recording": ("recording", read_recording),
        "plan": ("plan", lambda path: read_plan(path, interface)),
        "simulated hand": ("model", load_model),
    }


TOLERANT = ("learning curve", "end of a learning curve")
"""Readers of what a kill may have cut: they end at the first line that is not whole."""
_RUN = ("run", str(BUNDLE), "--unattended", "--no-record", "--driver")
COMMANDS: dict[str, tuple[str, Sequence[str]]] = {
    "train --hand": ("hand", ("train", "crawl", "--hand", "FILE", "--out", "OUT")),
    "train --resume": ("config", ("train", "--resume", "FILE")),
    "train --warm-start": (
        "onnx",
        ("train", "crawl", "--warm-start", "FILE", "--out", "OUT"),
    ),
    "eval": ("onnx", ("eval", "FILE", "--episodes", "1", "--out", "OUT")),
    "sweep": ("sweep", ("sweep", "FILE", "--out", "OUT")),
    "compare": ("config", ("compare", "FILE", "--out", "OUT")),
    "export": ("config", ("export", "FILE", "--out", "OUT")),
    "play": ("onnx", ("play", "FILE", "--seconds", "0.1")),
    "steer": ("onnx", ("steer", "FILE", "--seconds", "4")),
    "hand mjcf": ("hand", ("hand", "mjcf", "--hand", "FILE", "-o", "OUT.xml")),
    "hand import": ("mjcf", ("hand", "import", "FILE", "-o", "OUT")),
    "info": ("csv", ("sysid", "info", "FILE")),
    "info of a bag": ("recording", ("sysid", "info", "FILE")),
    "calibrate": ("csv", ("sysid", "calibrate", "FILE", "-o", "OUT")),
    "diagnose": ("parquet", ("sysid", "diagnose", "FILE", "-o", "OUT")),
    "excite": ("hand", ("sysid", "excite", "--hand", "FILE", "-o", "OUT")),
    "transfer": ("hand", ("sysid", "transfer", "--real", "FILE", "-o", "OUT")),
    "demo": ("onnx", ("demo", "--policy", "FILE", "--out", "OUT")),
    "deploy check": ("onnx", ("fingers-deploy", "check", "FILE")),
    "deploy log": ("recording", ("fingers-deploy", "log", "FILE", "--csv", "OUT.csv")),
    "deploy run": (
        "onnx",
        ("fingers-deploy", "run", "FILE", "--driver", "sim", "--model", "x"),
    ),
    "deploy guard": (
        "onnx",
        ("fingers-deploy", "guard", "FILE", "--driver", "sim", "--socket", "x"),
    ),
    "deploy model": ("model", ("fingers-deploy", *_RUN, "sim", "--model", "FILE")),
}
"""By name: the kind of file that a command reads, and its words."""

HAND = ("hand", "mjcf", "-o", "OUT.xml")
WORDS: tuple[tuple[tuple[str, ...], tuple[str, ...]], ...] = (
    (("train", "crawl", "--out", "OUT", "--seed"), ("WHOLE",)),
    (("train", "crawl", "--out", "OUT", "--seeds"), ("WHOLE",)),
    (("train", "crawl", "--out", "OUT", "--preset"), ("NAME",)),
    (("train", "crawl", "--out", "OUT", "--backend"), ("NAME",)),
    (("train", "crawl", "--out", "OUT", "--schedules"), ("NAME",)),
    (("train", "crawl", "--out", "OUT", "--set"), ("SETTING",)),
    (("train", "--out", "OUT"), ("NAME",)),
    (("train", "crawl", "--warm-start"), ("PATH",)),
    (("train", "crawl", "--hand"), ("PATH",)),
    (("train", "--resume"), ("PATH",)),
    (("eval", str(BUNDLE), "--episodes"), ("WHOLE",)),
    (("eval", str(BUNDLE), "--command", "0.1", "0"), ("NUMBER",)),
    (("eval", str(BUNDLE), "--set"), ("SETTING",)),
    (("eval",), ("PATH",)),
    (("play", str(BUNDLE), "--seconds"), ("NUMBER",)),
    (("play", str(BUNDLE), "--fps"), ("NUMBER",)),
    (("play",), ("PATH",)),
    (("steer", str(BUNDLE), "--seconds"), ("NUMBER",)),
    (("steer",), ("PATH",)),
    (("sweep",), ("PATH",)),
    (("compare",), ("PATH",)),
    (("export",), ("PATH",)),
    (("hand",), ("NAME",)),
    ((*HAND, "--hand"), ("PATH",)),
    (("sysid", "info"), ("PATH",)),
    (("sysid", "calibrate"), ("PATH",)),
    (("sysid", "diagnose"), ("PATH",)),
    (("sysid", "excite", "-o", "OUT", "--rate"), ("NUMBER",)),
    (("sysid", "excite", "-o", "OUT", "--waves"), ("NAME",)),
    (("sysid", "transfer", "-o", "OUT", "--real"), ("PATH",)),
    (("sysid",), ("NAME",)),
    (("demo", "--out", "OUT", "--policy"), ("PATH",)),
    ((), ("NAME",)),
    (("fingers-deploy",), ("NAME",)),
    (("fingers-deploy", "check"), ("PATH",)),
    (("fingers-deploy", "log"), ("PATH",)),
    (("fingers-deploy", "run"), ("PATH", "--driver", "sim", "--model", "x")),
    (("fingers-deploy", *_RUN), ("NAME",)),
    (("fingers-deploy", *_RUN, "sim", "--model", "x", "--loop-hz"), ("NUMBER",)),
    (("fingers-deploy", *_RUN, "sim", "--model", "x", "--duration"), ("NUMBER",)),
    (("fingers-deploy", *_RUN, "sim", "--model", "x", "--seed"), ("NUMBER",)),
    (("fingers-deploy", *_RUN, "sim", "--model", "x", "--wiggle"), ("NAME",)),
    (("fingers-deploy", *_RUN, "sim", "--model", "x", "--keys"), ("NAME",)),
    (("fingers-deploy", *_RUN, "sim", "--model"), ("PATH",)),
    (("fingers-deploy", *_RUN, "replay", "--log"), ("PATH",)),
    (("fingers-deploy", "guard"), ("PATH", "--driver", "sim", "--socket", "x")),
)
"""Commands that end in a word of a kind; `damaged` puts a bad one there."""

_TEXTS = ("", " ", "x" * 5000, "é" * 300, "\udcff", "a\nb", "\x1b[31m", "--nope", "-")
BAD: dict[str, tuple[str, ...]] = {
    "WHOLE": (*_TEXTS, "1_0", "١", "９", "1.5", "1e3", "-1", "9" * 30, "nan", "0x1g"),
    "NUMBER": (*_TEXTS, "1_0", "١.٥", "nan", "1,5", "-1e400", "1e", "inf", "0x10p"),
    "NAME": (*_TEXTS, "ALL", "tr4in", "../x", "null", "٣", "a b"),
    "PATH": (
        *(t for t in _TEXTS if t not in ("-",)),
        *(
            "nowhere",
            "/dev/zero",
            "/dev/null",
            "/dev/tty0",
            "/",
            ".",
            "..",
            "~",
            "a\0b",
        ),
        *("/proc/self/mem", "/proc/kmsg", "x/" * 3000, "/etc/shadow/x"),
    ),
    "SETTING": (
        *(t for t in _TEXTS if t != "-"),
        *("=", "a", "seed", "seed=", "seed=1_0", "seed=-1", "seed=1e3", "seed=٣"),
        *("ppo.actor_layers=[100000000]", "ppo.actor_layers=[]", "ppo.epochs=0"),
        *("ppo.unroll_length=1000000000", "num_envs=1048576", "num_envs=0"),
        *("ppo.epochs=99999999999999999999999999", "iterations=-1", "ppo=3"),
        *("ppo.clip=nan", "ppo.clip=.inf", "ppo.clip=[[[[1]]]]", "env.nope=1"),
        *("env=1", "env.action_clip=a", "task=push", "preset=fast", "ppo..clip=1"),
        *(f"ppo.clip={'[' * 900}", f"{'a.' * 900}=1", "hang_limit_s=-1", "seed=&a 1"),
        *('preset="\\ud800"', "seed={a: 1}", "backend=7", "ppo.noise_std_type=no"),
    ),
}
