"""Sound files of every kind that is read, small, to be damaged."""

import json
import shutil
from pathlib import Path

import numpy as np

import fingers_mjx
from envs.config.typed import to_dict
from envs.hand.hand_file import DEFAULT_HAND_FILE, load_hand_file
from envs.hand.standing_mjcf import standing_mjcf
from fingers_deploy.bundle import load_bundle
from fingers_mjx.evaluation.files import write_table
from fingers_mjx.ppo.config import preset
from fingers_mjx.runs.directory import record_run
from fingers_mjx.runs.setup import new_setup
from fingers_robot.record.recorder import Recorder
from fingers_robot.record.row import empty_row
from sysid.logs.log import make_log
from sysid.logs.read import write_log

BUNDLE = Path(fingers_mjx.__file__).parent / "policies" / "crawl"
_ROWS = 40
_MJCF = """<mujoco><worldbody><body><joint name="knee" axis="0 1 0"/>
<geom size=".1" mass="1"/></body></worldbody></mujoco>"""
_DRIVE = "schema: 1\njoints:\n  '*':\n    kp: {value: 5.0}\n    kd: {value: 0.1}\n"
_SWEEP = "task: crawl\nseeds: 2\nstages:\n  first: {preset: cpu}\n"


def write_originals(folder: Path) -> dict[str, Path]:
    """Writes one sound file of each kind into a folder; returns them by kind."""
    folder.mkdir(parents=True)
    files = {
        "hand": folder / "hand.yaml",
        "csv": folder / "log.csv",
        "parquet": folder / "log.parquet",
        "plan": folder / "plan.csv",
        "model": folder / "model.xml",
        "mjcf": folder / "mechanism.xml",
        "drive": folder / "drive.yaml",
        "sweep": folder / "sweep.yaml",
        "metrics": folder / "metrics.jsonl",
        "table": folder / "episodes.parquet",
    }
    shutil.copy(DEFAULT_HAND_FILE, files["hand"])
    for kind in ("csv", "parquet"):
        write_log(_log(), files[kind])
    files["model"].write_text(standing_mjcf(load_hand_file()), "utf-8")
    files["mjcf"].write_text(_MJCF, "utf-8")
    files["drive"].write_text(_DRIVE, "utf-8")
    files["sweep"].write_text(_SWEEP, "utf-8")
    files["plan"].write_text(_plan(), "utf-8")
    rows = [
        {"iteration": k, "time_s": 0.5 * k, "loss": 1.0 / (k + 1)} for k in range(9)
    ]
    files["metrics"].write_text("".join(f"{json.dumps(r)}\n" for r in rows), "utf-8")
    write_table(files["table"], {"speed": np.linspace(0.0, 1.0, 8)})
    files |= _run(folder / "run") | _bundle(folder / "bundle")
    return files | {"recording": _recording(folder)}


def _log():
    t_s = 0.002 * np.arange(_ROWS)
    wave = 0.1 * np.sin(t_s)
    return make_log(("knee",), t_s, {"cmd.knee": wave, "pos.knee": wave})


def _plan() -> str:
    joint = load_bundle(BUNDLE).manifest.interface.joint_names[0]
    return f"t,cmd.{joint}\n0,0.1\n0.02,0.1\n0.04,0.1\n"


def _run(folder: Path) -> dict[str, Path]:
    """The files of a run directory, without a checkpoint."""
    folder.mkdir()
    setup = new_setup(preset("cpu"), None)
    config = {"train": to_dict(setup.train), "env": to_dict(setup.env)}
    record_run(folder, config, {"train": to_dict(setup.train)}, setup.hand)
    return {"run.json": folder / "run.json", "config": folder / "config.yaml"}


def _bundle(folder: Path) -> dict[str, Path]:
    shutil.copytree(BUNDLE, folder)
    return {"onnx": folder / "policy.onnx", "manifest": folder / "manifest.json"}


def _recording(folder: Path) -> Path:
    names = load_bundle(BUNDLE).manifest.interface.joint_names
    recorder = Recorder(folder, "recording", names, {}, 0.0)
    for k in range(_ROWS):
        row = empty_row()
        row["t"] = 0.02 * k
        recorder.row(0.02 * k, row)
    recorder.event(0.1, "disabled -> arming")
    recorder.close()
    return recorder.files[0]
