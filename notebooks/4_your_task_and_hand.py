# %% [markdown]
# # Your own task and your own hand
#
# A task is a configuration, a table of rewards and a few methods; nothing in the
# packages has to change. This notebook makes one, trains it for two minutes, and shows
# that the hand does what it is paid for. Then it takes another hand: its model comes
# from an MJCF file, as yours would.

# %%
import importlib.util
import os
import subprocess
import sys

# Nothing is published yet: Colab needs the address of a repository that holds it, such
# as "git+https://HOST/OWNER/fingers_mjx".
ADDRESS = os.environ.get("FINGERS_PACKAGE", "")
if importlib.util.find_spec("rewards") is None:  # as in Colab
    assert ADDRESS, "write the address of a repository behind ADDRESS in this cell"
    wanted = [f"fingers-deploy @ {ADDRESS}#subdirectory=deploy"]
    wanted += [f"fingers-mjx[viz] @ {ADDRESS}"]
    subprocess.run([sys.executable, "-m", "pip", "install", "-q", *wanted], check=True)

# %%
# %matplotlib inline
import dataclasses
import time
from dataclasses import dataclass, field
from pathlib import Path

import jax.numpy as jnp
import matplotlib as mpl
import numpy as np

from envs.commands import CommandConfig
from envs.hand.hand_file import load_hand_file, save_hand_file
from envs.hand.importing.convert import import_hand
from envs.hand.importing.joint_map import DriveMap, JointMap
from envs.hand.stance import stance_of
from envs.hand.stance_search import with_stance
from envs.registry import Task, register
from envs.task import HandSettings, HandTask
from envs.tasks.upright import near_stance
from fingers_mjx.demo.explore import explore
from fingers_mjx.demo.learn import untrained
from fingers_mjx.pictures.hand import pictures, posed
from fingers_mjx.policy.actor import load_policy
from fingers_mjx.policy.interface import identity
from fingers_mjx.ppo.config import PpoConfig, preset
from fingers_mjx.reports.figures import (
    GREY,
    INK,
    LINES,
    STYLE,
    panels_of,
    training_curves,
)
from fingers_mjx.runs.metrics import read_metrics
from fingers_mjx.runs.setup import make_env, new_setup
from fingers_mjx.training.train import train
from rewards import RewardTerm, action_rate, stance_height

mpl.rcParams.update(STYLE)
FAST = bool(os.environ.get("NOTEBOOK_FAST"))
RUN = Path(time.strftime("run-%Y%m%d-%H%M%S"))

# %% [markdown]
# ## A task
#
# The hand is to hold its palm at a height. Settings that every hand has (episode,
# observation, randomization) are inherited; `height_m` is our own, and is known to
# `--set env.height_m=0.1` as soon as the task is registered. The reward is a table of
# rows: name, function, weight, and the names of its arguments. Functions are those of
# the package `rewards`, or of your own; `magnitudes` brings what the table needs
# besides the signals that every task has.


# %%
def near(height_m, wanted_m):
    """Closeness to a height: the kernel of the package, 2 cm wide."""
    return stance_height(height_m, wanted_m, 0.02)


TABLE = (
    RewardTerm("low", near, 1.0, ("height_m", "wanted_m")),
    RewardTerm("action_rate", action_rate, -0.01, ("action", "previous_action")),
)


@dataclass(frozen=True)
class CrouchConfig(HandSettings):
    """Settings: at which height."""

    height_m: float = field(default=0.11, metadata={"unit": "m", "low": 0.0})
    command: CommandConfig = field(default_factory=CommandConfig)


@dataclass(frozen=True)
class Crouch(HandTask):
    """The hand holds its palm at a height."""

    config: CrouchConfig
    table: tuple = TABLE

    def begin_episode(self, key, world, state):
        """No command."""
        return {"command": jnp.zeros(3)}

    def start(self, key, plant, world):
        """The stance, with noise."""
        return near_stance(key, plant, 0.05, 0.0), jnp.array(plant.stance.target_rad)

    def magnitudes(self, memory, signals, valid):
        """Heights: as it is, and as it should be [m]."""
        wanted_m = jnp.array(self.config.height_m)
        return memory, {"height_m": signals.palm_pos_w[2], "wanted_m": wanted_m}

    def terminated(self, signals):
        """The palm touches something."""
        return signals.palm_contact > 0

    def measures(self, signals):
        """Height of the palm [m]."""
        return {"height_m": signals.palm_pos_w[2]}


register("crouch_here", Task(CrouchConfig, Crouch.on, summary="hold the palm low"))

# %% [markdown]
# ## Its training
#
# From here on all is as for the tasks of the package.

# %%
config = dataclasses.replace(preset("cpu", "crouch_here"), iterations=60)
if FAST:
    tiny = PpoConfig(unroll_length=4, epochs=1, actor_layers=(8,), critic_layers=(8,))
    config = dataclasses.replace(config, num_envs=4, iterations=4, ppo=tiny)
setup = new_setup(config, None)
env = make_env(setup, config.num_envs, config.backend)


def show(event):
    """One line that rewrites itself."""
    if event["event"] == "progress":
        line = "iteration {iteration} of {iterations}, {env_steps:,} control steps"
        print("\r" + line.format(**event), end="")


result = train(env, setup, RUN, identity=identity(env), on_progress=show)
rows = read_metrics(RUN / "metrics.jsonl")
curves = {"reward/low": "reward of a step, height [1]"}
curves["episode/length"] = "length of an episode [steps]"
training_curves({"run": rows}, curves, x="env_steps")

# %% [markdown]
# Height of the palm in 32 randomized worlds, without exploration noise: under the
# policy at the start, which leaves the hand in its stance, and after training. A line
# ends where the palm touches something.

# %%
worlds = make_env(setup, 4 if FAST else 32, "cpu", auto_reset=False)
policies = {} if FAST else {"before": untrained(setup, env)}
policies["after"] = load_policy(RUN)
figure, (panel,) = panels_of(1, (7.6, 3.0))
for (name, network), colour in zip(policies.items(), (GREY, LINES[0]), strict=False):
    table = explore(worlds, network, 0.0, 20 if FAST else 250, 1, lambda *_: None)
    fallen = np.maximum.accumulate(np.array(table.traces.failed), axis=0)
    heights_mm = 1e3 * np.array(table.traces.palm_pos_w)[..., 2]
    heights_mm[fallen] = np.nan
    times = env.dt * (1 + np.arange(len(heights_mm)))
    panel.plot(times, heights_mm, color=colour, lw=0.6, alpha=0.5)
    panel.plot(times, np.nanmedian(heights_mm, 1), color=colour, lw=2, label=name)
panel.axhline(1e3 * setup.env.height_m, color=INK, ls="--", label="wanted")
panel.set(xlabel="time [s]", ylabel="height of the palm [mm]")
panel.legend(ncols=3)
figure

# %% [markdown]
# As a package that others install, with an entry point by which every command knows
# the task, it is `examples/outside_task`; it has a driver and a log reader too.
#
# ## A hand
#
# `fingers hand import MODEL.xml --joint-map MAP.yaml -o my_hand.yaml` turns an MJCF
# model into a hand file; here in Python. The model is one that has little in common
# with the default hand: four fingers of three joints, of capsules, on a flat palm.

# %%
FINGER = """
<body name="{name}_base" pos="{x} {y} 0">
  <joint name="{name}_1" axis="0 {s}1 0" range="-0.3 1.6"/>
  <geom fromto="0 0 0 {s}0.012 0 0" mass="0.012"/>
  <body pos="{s}0.014 0 0">
    <joint name="{name}_2" axis="0 0 1" range="-0.5 0.5"/>
    <geom fromto="{s}0.004 0 0 {s}0.045 0 0" mass="0.022"/>
    <body pos="{s}0.05 0 0">
      <joint name="{name}_3" axis="0 {s}1 0" range="-0.3 1.6"/>
      <geom fromto="{s}0.004 0 0 {s}0.042 0 0" mass="0.018"/>
    </body>
  </body>
</body>"""
WHERE = {
    "thumb": (-0.045, 0.0),
    "index": (0.05, 0.036),
    "middle": (0.054, 0.0),
    "ring": (0.05, -0.036),
}
JOINTS = {finger: tuple(f"{finger}_{k}" for k in (1, 2, 3)) for finger in WHERE}


def mjcf():
    """The model as text."""
    bodies = "".join(
        FINGER.format(name=name, x=x, y=y, s="" if x > 0 else "-")
        for name, (x, y) in WHERE.items()
    )
    motors = "".join(
        f'<position name="{joint}" joint="{joint}"/>'
        for joints in JOINTS.values()
        for joint in joints
    )
    return f"""<mujoco><compiler angle="radian" autolimits="true"/>
<default><joint armature="0.001" damping="0.02"/>
<position kp="4" kv="0.08" forcerange="-0.8 0.8"/>
<geom type="capsule" size="0.008"/></default>
<worldbody><body name="palm"><freejoint/>
<geom type="box" size="0.045 0.045 0.012" mass="0.22"/>{bodies}</body></worldbody>
<actuator>{motors}</actuator></mujoco>"""


Path("my_hand.xml").write_text(mjcf())
mapped = JointMap(fingers=JOINTS, drive=DriveMap(speed_limit=4.0))
found = import_hand("my_hand.xml", mapped)
print("\n".join(found.notes))

# %% [markdown]
# Nobody knows how such a hand stands: a stance is searched, settled and kept in the
# hand file, and a hand for which none is found is refused. Then it trains like the
# default one: `fingers train crawl --hand my_hand.yaml`. Both hands in their stances,
# from the left:

# %%
hand = with_stance(found.hand, starts=4 if FAST else 40)
save_hand_file(hand, Path("my_hand.yaml"))
figure, panels = panels_of(2, (9.6, 3.7))
mine = load_hand_file(Path("my_hand.yaml"))
for panel, (name, hand) in zip(
    panels, {"mine": mine, "the default hand": load_hand_file()}.items(), strict=True
):
    panel.imshow(pictures(posed(hand, stance_of(hand)))["left"])
    panel.set_title(name)
    panel.axis("off")
figure

# %% [markdown]
# What is taken from a model, how its joints are named, and what a hand must have is in
# `docs/guides/hand.md`; `examples/second_hand` trains such a hand, and the LEAP hand.
