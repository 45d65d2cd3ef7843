# %% [markdown]
# # Train, evaluate, export and run a small policy
#
# From nothing to a policy in the robot's own code, on two CPU cores: sixty iterations
# of PPO, an evaluation in worlds that differ from each other, an export, and the same
# episode twice, in the training environment and through the shim that runs on the
# robot. The hand learns to stay on its feet here; a gait takes five hundred times as
# many steps, and the committed policy, which had them, stands beside for comparison.

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
from pathlib import Path

import jax
import matplotlib as mpl
import numpy as np

import fingers_mjx
from fingers_deploy import load_bundle
from fingers_mjx.demo.explore import explore
from fingers_mjx.demo.learn import untrained
from fingers_mjx.export.run import export_run
from fingers_mjx.pictures.camera import Camera
from fingers_mjx.pictures.video import frames
from fingers_mjx.play.player import Player
from fingers_mjx.policy.actor import act, load_policy
from fingers_mjx.policy.interface import identity
from fingers_mjx.policy.source import load_source
from fingers_mjx.ppo.config import PpoConfig, preset
from fingers_mjx.reports.figures import (
    INK,
    LINES,
    STYLE,
    panels_of,
    standing,
    training_curves,
)
from fingers_mjx.runs.metrics import read_metrics
from fingers_mjx.runs.setup import make_env, new_setup
from fingers_mjx.training.train import train

mpl.rcParams.update(STYLE)
FAST = bool(os.environ.get("NOTEBOOK_FAST"))
WALKING = Path(fingers_mjx.__file__).parent / "policies" / "crawl"
RUN = Path(time.strftime("run-%Y%m%d-%H%M%S"))

# %% [markdown]
# ## Train
#
# A run is made of settings (of the learner, of the task) and a hand. The preset `cpu`
# has small networks, and starts with a policy that hardly moves the hand. In a shell
# this is `fingers train crawl --preset cpu --set iterations=60 --out RUN`.

# %%
config = dataclasses.replace(preset("cpu"), iterations=60)
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

# %% [markdown]
# ## What was learned, from inside
#
# `metrics.jsonl` of the run directory has a row every second iteration. How long an
# episode lasts until the hand falls, while the policy still tries out random motions
# (a whole episode has 1,000 steps), and what it collects until then.

# %%
rows = read_metrics(RUN / "metrics.jsonl")
curves = {"episode/length": "length of an episode [steps]"}
curves["episode/return"] = "return of an episode [1]"
training_curves({"run": rows}, curves, x="env_steps")

# %% [markdown]
# What a step is paid: the six largest terms. Most comes for the commanded velocity,
# which a hand that stands gets in part, the more the slower the command; rocking, and
# palm or links on the floor, cost less and less.

# %%
terms = [name for name in rows[-1] if name.startswith("reward/")]
most = sorted(terms, key=lambda name: -max(abs(row[name]) for row in rows))[:6]
figure, (panel,) = panels_of(1, (7.6, 3.0))
steps = [row["env_steps"] for row in rows]
for name, colour in zip(most, LINES, strict=False):
    label = name.removeprefix("reward/").replace("_", " ")
    panel.plot(steps, [1e3 * row[name] for row in rows], color=colour, label=label)
panel.axhline(0, color=INK, lw=0.8)
panel.set(xlabel="environment steps", ylabel="reward of a step [0.001]")
panel.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
figure

# %% [markdown]
# ## What was learned, from outside
#
# The same randomized worlds (friction, gains, torques, masses, sensors) under the
# policy that the run started from, and under the one of its last checkpoint, each with
# its exploration noise.

# %%
EPISODES, STEPS, SEED = (4, 20, 1) if FAST else (64, 500, 1)
worlds = make_env(setup, EPISODES, "cpu", auto_reset=False)
trained, start = load_policy(RUN), untrained(setup, env)


def measured(network, noise):
    """Episodes of a policy with this much noise on its actions."""
    return explore(worlds, network, noise, STEPS, SEED, lambda *_: None)


after = measured(trained, trained.noise_std)
before = after if FAST else measured(start, config.ppo.init_noise_std)
fallen = {"before": before.traces.failed, "after": after.traces.failed}
standing(fallen, env.dt)

# %% [markdown]
# Now without noise, beside the committed policy with 180 million steps behind it: the
# speed that was asked for, and the speed that came. Ours has learned to stand, under
# nearly every command, and often falls where it was asked for more than that. Falling
# is expensive at once, walking pays only once it works.

# %%
quiet = measured(trained, 0.0)
walking = quiet if FAST else measured(load_source(WALKING).network, 0.0)
figure, panels = panels_of(2, (8.4, 3.2))
for panel, (name, table) in zip(
    panels,
    {"this notebook's": quiet, "the committed one": walking}.items(),
    strict=True,
):
    asked = table.columns["command_speed_mps"]
    survived = 100 * table.columns["survival"].mean()
    panel.plot((0, 0.16), (0, 0.16), "--", color=INK, lw=1)
    panel.plot(asked, table.columns["task_speed_mps"], "o", color=LINES[0], alpha=0.6)
    panel.set(title=f"{name}: {survived:.0f} % stay up", xlabel="asked for [m/s]")
    panel.set(xlim=(0, 0.2), ylim=(-0.05, 0.18), ylabel="achieved [m/s]")
figure

# %% [markdown]
# ## Export
#
# A bundle is `policy.onnx` and `manifest.json` (what the policy sees, in which order
# and unit, and what its output means). It needs neither JAX nor this package to run.
# The export compares ONNX Runtime and a policy in NumPy with JAX, and refuses a
# difference above 1e-5, times the largest action before the clip where that is above 1.

# %%
report = export_run(RUN, RUN / "bundle")
bundle = load_bundle(RUN / "bundle")
print(
    f"{len(bundle.model) / 1e3:.0f} kB; over {report.observations:,} observations at "
    f"most {report.onnxruntime:.0e} (ONNX Runtime), {report.numpy:.0e} (NumPy) off JAX"
)

# %% [markdown]
# ## The same episode twice
#
# The first episode of the evaluation was one of the training environment: its
# observations, the network in JAX. Here it is once more as on the robot: C MuJoCo
# moves the hand, `fingers_deploy` makes the observation of raw measurements, ONNX
# Runtime runs the network, and the shim makes joint targets of its output. World,
# start, command and sensor noise are drawn alike.

# %%
key = jax.random.split(jax.random.fold_in(jax.random.key(SEED), 0), EPISODES)[0]
twin = jax.tree.map(np.asarray, quiet.episode(0))
player = Player(make_env(setup, 1, "cpu"), bundle, "onnxruntime")
episode = player.begin(key)
seen, ordered, moved, poses = [], [], [], [episode.data.qpos.copy()]
for _ in range(len(twin.done)):
    moved.append(np.array(player.step(episode).joint_pos))
    seen.append(player.controller.observation)
    ordered.append(player.controller.action)
    poses.append(episode.data.qpos.copy())

# %%
clip = setup.env.action_clip
gaps = np.abs(np.array(ordered) - np.clip(act(trained, np.array(seen)), -clip, clip))
angle, wanted = np.degrees(moved), np.degrees(twin.joint_pos)
times = player.env.dt * (1 + np.arange(len(angle)))
figure, panels = panels_of(2, (9.4, 3.2))
for joint, colour in zip((4, 5, 8, 9, 12), LINES, strict=False):
    panels[0].plot(times, wanted[:, joint], color=colour, lw=5, alpha=0.3)
    panels[0].plot(times, angle[:, joint], color=colour, lw=1.2)
panels[0].set(xlabel="time [s]", ylabel="joint angle [°]")
panels[0].set_title("wide: environment, thin: shim")
far = np.abs(angle - wanted).max(1)
for values, label, colour in (
    (far, "joint angle [°]", LINES[1]),
    (gaps.max(1), "network's output [1]", LINES[0]),
):
    panels[1].semilogy(times, np.maximum(values, 1e-9), color=colour, label=label)
panels[1].set(xlabel="time [s]", title="largest difference of any joint")
panels[1].legend()
figure

# %% [markdown]
# ## What it looks like
#
# The policy of this notebook above, the committed one below, in the same world and
# under the same command, from a camera that stays where it is: one stands and spreads
# its fingers, the other walks away and turns.

# %%
walker = Player(player.env, load_bundle(WALKING))
walk = walker.play(key, len(angle)).qpos
middle = walk[:, :2].mean(0)
camera = Camera((float(middle[0]), float(middle[1]), 0.05), 0.9, 250.0, -25.0)
strips = [
    qpos[np.linspace(0, len(qpos) - 1, 2 if FAST else 5).astype(int)]
    for qpos in (np.array(poses), walk)
]
shown = np.concatenate(strips)
drawn = frames(player.env.mj_model, shown, [camera] * len(shown), (360, 270))
figure, panels = panels_of(len(shown), (10.0, 3.2), rows=2)
for panel, picture in zip(panels, drawn, strict=True):
    panel.imshow(picture)
    panel.axis("off")
figure

# %% [markdown]
# ## From here to a gait
#
# The same run with the preset `fast` on one GPU walks after some minutes:
# `fingers train crawl --preset fast --out RUN`, then `fingers eval RUN`, `fingers play
# RUN --viewer`. What else there is to set is in `fingers train crawl --help`, and how a
# run goes on after Ctrl-C in `docs/guides/training.md`.
