# %% [markdown]
# # A hidden effect in measured data
#
# A servo moves an arm, and something is wrong with it that its data sheet does not
# say. Here the servo is simulated, by twenty lines of this notebook that share nothing
# with the simulation that is fitted, so that the truth is known. The record of twenty
# seconds goes to the diagnosis, which names the cause and its size; then the same for
# other sizes, none among them; and at last what such servos do to a walking hand.
#
# With a record of your own, begin at "Ask": `fingers sysid diagnose` does the same.

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
from pathlib import Path

import jax
import matplotlib as mpl
import mujoco
import numpy as np

import fingers_mjx
from envs.actuator.catalogue import effect_kind
from envs.hand.hand_file import Effect
from envs.hand.quantity import Quantity
from fingers_mjx.evaluation.setups import nominal
from fingers_mjx.play.player import Player
from fingers_mjx.policy.source import load_bundle_setup
from fingers_mjx.reports.diagnosis import diagnosis_figures
from fingers_mjx.reports.figures import GREY, INK, LINES, STYLE, panels_of
from fingers_mjx.runs.setup import make_env
from sysid.diagnosis.diagnose import examine
from sysid.drive import JointDrive, Nominal
from sysid.logs.log import make_log
from sysid.mechanism import model_mechanism

mpl.rcParams.update(STYLE)
FAST = bool(os.environ.get("NOTEBOOK_FAST"))

# %% [markdown]
# ## A servo that nobody knows
#
# A position servo with an arm of half a kilogram, and a low-pass of 3 Hz between target
# and servo. What is hidden: within 0.02 rad of its target it does nothing. Steps are of
# 0.1 ms: at 0.5 ms the error of this integration is a damping of 0.01 N·m·s/rad, which
# the diagnosis reports as unexplained. Besides, the gain is 2 % and the mass 1 % off
# what is believed, and angle and torque are read with noise.

# %%
KP, KD, MASS_KG, ARM_M, ROTOR = 24.0, 0.7, 0.5, 0.15, 0.002
FILTER_HZ = 3.0
RATE_HZ, ROUND_S, ROUNDS = (100, 3.0, 2) if FAST else (200, 10.0, 2)
HIDDEN_RAD = 0.02


def servo(target, deadband, dt=0.0001):
    """Angles [rad] and torques [N·m] of the servo, one for each target."""
    inertia, weight = 1.01 * MASS_KG * ARM_M**2 + ROTOR, 1.01 * MASS_KG * ARM_M * 9.81
    q, v, filtered, rows = 0.0, 0.0, 0.0, []
    for goal in target:
        rows.append((q, _torque(filtered - q, v, deadband)))
        for _ in range(round(1 / RATE_HZ / dt)):
            filtered += dt * 2 * np.pi * FILTER_HZ * (goal - filtered)
            torque = _torque(filtered - q, v, deadband) - weight * np.sin(q)
            v += dt * torque / inertia
            q += dt * v
    return np.array(rows).T


def _torque(error, v, deadband):
    outside = max(abs(error) - deadband, 0.0)
    return 1.02 * KP * np.sign(error) * outside - KD * v


# %% [markdown]
# What is sent: slow and fast sines together, twice the same, so that the difference of
# the repeats is the noise (`docs/guides/diagnose.md` says what
# to record; `fingers sysid excite` plans it).


# %%
def targets():
    """Targets [rad] of all rounds."""
    t = np.arange(0, ROUND_S, 1 / RATE_HZ)
    turns = 2 * np.pi * t / ROUND_S
    waves = ((2, 0.25, 0.0), (5, 0.12, 1.0), (9, 0.08, 2.0), (14, 0.04, 3.0))
    start = np.minimum(1.0, np.minimum(t, ROUND_S - t))  # from rest, and back to it
    round_rad = start * sum(a * np.sin(n * turns + phase) for n, a, phase in waves)
    return np.tile(round_rad, ROUNDS)


def recorded(deadband, seed=0):
    """The log of the servo: target, angle and torque in rows of 5 ms."""
    rng, cmd = np.random.default_rng(seed), targets()
    angle, torque = servo(cmd, deadband)
    columns = {
        "cmd.arm": cmd,
        "pos.arm": angle + rng.normal(0, 2e-4, len(cmd)),
        "tau.arm": torque + rng.normal(0, 5e-3, len(cmd)),
    }
    return make_log(("arm",), np.arange(len(cmd)) / RATE_HZ, columns, source="servo")


log = recorded(HIDDEN_RAD)
shown = slice(0, round(ROUND_S * RATE_HZ))
angle, cmd, torque = (log.columns[f"{name}.arm"] for name in ("pos", "cmd", "tau"))
figure, (panel,) = panels_of(1, (9.4, 2.6))
panel.plot(log.t_s[shown], np.degrees(cmd[shown]), color=GREY, label="target")
panel.plot(log.t_s[shown], np.degrees(angle[shown]), color=LINES[0], label="measured")
panel.set(xlabel="time [s]", ylabel="angle [°]")
panel.legend(ncols=2, loc="upper right")
figure

# %% [markdown]
# ## Ask
#
# What is believed of the servo: an MJCF model of the arm, gains within 5 %, and the
# low-pass. Every effect of the catalogue is fitted from several starts, and counts only
# if it predicts parts of the record better that its fit did not see.

# %%
ARM = f"""
<mujoco><worldbody><body>
<joint name="arm" axis="0 1 0" armature="{ROTOR}"/>
<inertial pos="0 0 -{ARM_M}" mass="{MASS_KG}" diaginertia="1e-6 1e-6 1e-6"/>
</body></worldbody></mujoco>"""
path = {"lowpass_cutoff": {"cutoff_hz": Nominal(FILTER_HZ)}}
drive = JointDrive(Nominal(KP), Nominal(KD), effects=path)
arm = model_mechanism(mujoco.MjModel.from_xml_string(ARM), {"arm": drive})
diagnosis, examined = examine([log], arm)
print(f"{diagnosis.verdict}: {diagnosis.summary}")

# %% [markdown]
# Measured on the servo, and simulated by the model of the diagnosis: as it was
# believed to be (before), and with the cause in it (after).

# %%
drawn = list(diagnosis_figures(examined[0]).values())
drawn[0]

# %% [markdown]
# What does not balance in the equations of servo and arm, over what it may depend on:
# means over bins, before in red and after in blue.

# %%
drawn[2]

# %% [markdown]
# ## Is it right?
#
# The truth is known here. The same servo with other deadbands, and with none at all:
# where nothing is hidden, nothing should be found.

# %%
sizes = (HIDDEN_RAD,) if FAST else (0.0, 0.005, 0.01, HIDDEN_RAD)
answers = {HIDDEN_RAD: diagnosis}
for size in sizes:
    if size not in answers:
        answers[size] = examine([recorded(size, seed=1)], arm)[0]
figure, (panel,) = panels_of(1, (5.6, 3.2))
panel.plot((0, 25), (0, 25), "--", color=GREY, lw=1)
for size in sizes:
    answer = answers[size]
    print(f"hidden {1e3 * size:4.1f} mrad: {answer.summary}")
    for cause in answer.causes:
        if cause.effect == "deadband":
            width = cause.parameters["half_width_rad"]
            ends = 1e3 * np.array(
                [[width.value - width.low], [width.high - width.value]]
            )
            panel.errorbar(
                1e3 * size, 1e3 * width.value, ends, fmt="o", color=LINES[0], capsize=4
            )
    if not answer.causes:
        panel.plot(1e3 * size, 0, "o", mfc="white", mec=INK)
panel.set(xlabel="hidden [mrad]", ylabel="found, 95 % interval [mrad]")
figure

# %% [markdown]
# ## What such servos do to a walk
#
# The committed policy, told to walk straight on for ten seconds: in the hand that it
# was trained for, and in one whose servos all have a deadband of 0.04 rad. A hand file
# with the effect in it is what `fingers sysid diagnose` writes and `fingers train
# --hand` takes.

# %%
bundle, setup = load_bundle_setup(
    Path(fingers_mjx.__file__).parent / "policies" / "crawl"
)
width = Quantity(0.04, effect_kind("deadband").units()["half_width_rad"], "user")
deadband = Effect("deadband", {"half_width_rad": width}, ("all",))
calm, steps = nominal(setup), 20 if FAST else 500
command = np.tile(np.float32([0.12, 0.0, 0.0]), (steps, 1))
figure, (panel,) = panels_of(1, (7.0, 3.4))
hands = {"as believed": (), "with the deadband": (deadband,)}
for (name, effects), colour in zip(hands.items(), LINES, strict=False):
    hand = dataclasses.replace(setup.hand, effects=effects)
    world = make_env(dataclasses.replace(calm, hand=hand), 1, "cpu")
    played = Player(world, bundle).play(jax.random.key(0), steps, command)
    path_m = np.array(played.trace.palm_pos_w)[:, :2]
    panel.plot(*(path_m - path_m[0]).T, color=colour, lw=2, label=name)
panel.set(aspect="equal", xlabel="forward [m]", ylabel="left [m]")
panel.legend()
figure

# %% [markdown]
# ## With a log of your own
#
# ```sh
# fingers sysid diagnose arm.csv --mjcf arm.xml --drive drive.yaml -o diagnosis
# fingers train crawl --hand diagnosis/hand.yaml   # where the log is of the hand
# ```
#
# What a log needs is in `docs/guides/logs.md`, how often the answer is right, and when
# it is not, in `docs/results/diagnosis.md`, and what policies trained on an extended
# hand gain in `benchmarks/claims/README.md`.
