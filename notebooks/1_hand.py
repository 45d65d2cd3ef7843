# %% [markdown]
# # The hand and its stance
#
# Twenty position-controlled joints carry a palm and a module of electronics on five
# fingertips. This notebook looks at that hand without any training: what it weighs and
# where, how it stands, which finger carries how much, how hard its servos have to work
# for it, and what happens with softer servos. Physics is plain C MuJoCo.

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

import matplotlib as mpl
import mujoco
import numpy as np
from scipy.spatial import ConvexHull

from envs.hand.hand_file import load_hand_file
from envs.hand.nominal import FINGERS
from envs.hand.stance import stance_of
from fingers_mjx.pictures.hand import facts, pictures, posed
from fingers_mjx.reports.figures import (
    FINGER_COLOURS,
    GREY,
    INK,
    LINES,
    STYLE,
    panels_of,
)

mpl.rcParams.update(STYLE)
FAST = bool(os.environ.get("NOTEBOOK_FAST"))

# %% [markdown]
# ## What stands here
#
# A hand file holds everything that differs from hand to hand; the default one is the
# paper's. Its stance is stored: the joint targets that were searched, and the pose into
# which the hand settles under them.

# %%
hand = load_hand_file()
standing = posed(hand, stance_of(hand))
shown = pictures(standing)
figure, panels = panels_of(2, (9.6, 3.7))
for panel, side in zip(panels, ("left", "front"), strict=True):
    panel.imshow(shown[side])
    panel.axis("off")
figure

# %% [markdown]
# V is the control frame: level in the stance, its x towards where the four fingers
# point. Commands, the footprint and most rewards are written in it. Arrows at the tips
# are the normals of the pads: a hand that walks on its nails has them pointing up.

# %%
for name, value in facts(standing).items():
    print(f"{name:24} {value:7.1f}")

# %% [markdown]
# ## Where its mass is
#
# Nearly half of the mass is fingers: a finger that swings moves what stands.

# %%
model = standing.model
names = [model.body(i).name for i in range(model.nbody)]
mass_g = dict(zip(names, 1e3 * model.body_mass, strict=True))
parts = {"palm": mass_g["palm"], "module": mass_g["payload"]} | {
    finger: sum(mass_g[f"finger{number}_link{link}"] for link in range(1, 5))
    for number, finger in enumerate(FINGERS, 1)
}
colours = (INK, GREY, *FINGER_COLOURS)
figure, (panel,) = panels_of(1, (8.4, 1.7))
left = 0.0
for (part, grams), colour in zip(parts.items(), colours, strict=True):
    panel.barh(0, grams, left=left, color=colour, edgecolor="white")
    panel.text(left + grams / 2, 0.5, f"{part}\n{grams:.0f} g", ha="center")
    left += grams
panel.set(xlim=(0, left), ylim=(-0.5, 1.3), yticks=[], xlabel="mass [g]")
panel.grid(False)
print(f"in all {left:.0f} g")
figure

# %% [markdown]
# ## Who carries how much
#
# From above: the tips on the floor, the polygon that they support, and the centre of
# mass, whose distance to the nearest edge is the static margin. The area of a disc is
# the force that the tip carries, after holding the targets for four seconds.


# %%
def settled(hand_file):
    """The hand after holding its stance's targets for four seconds."""
    after = posed(hand_file, stance_of(hand_file))
    for _ in range(round((0.5 if FAST else 4.0) / after.model.opt.timestep)):
        mujoco.mj_step(after.model, after.data)
    return after


def carried_n(after):
    """Force of the floor on each tip."""
    sensors = [f"force_finger{number}_link4_tip" for number in range(1, 6)]
    return np.array([np.linalg.norm(after.data.sensor(s).data) for s in sensors])


still = settled(hand)
force_n, tips_mm = carried_n(still), 1e3 * still.tips_w[:, :2]
centre_mm = 1e3 * still.com_w[:2]
hull = tips_mm[ConvexHull(tips_mm).vertices]
figure, (panel,) = panels_of(1, (5.6, 4.4))
panel.fill(hull[:, 1], hull[:, 0], color="#e8eef5", ec=GREY)
for (x, y), force, finger, colour in zip(
    tips_mm, force_n, FINGERS, FINGER_COLOURS, strict=True
):
    panel.scatter(y, x, 420 * force, color=colour, alpha=0.75, lw=0)
    panel.text(y, x + 11, f"{finger} {force:.1f} N", ha="center")
panel.plot(centre_mm[1], centre_mm[0], "x", color=INK, ms=9, mew=2)
panel.text(centre_mm[1] - 4, centre_mm[0], "centre of mass", va="center")
panel.set(aspect="equal", xlabel="y, left [mm]", ylabel="x, forward [mm]")
panel.set(xlim=(70, -70), ylim=(-20, 150))
weight_n = 9.81 * float(model.body_subtreemass[1])
print(f"the tips push with {force_n.sum():.2f} N, the hand weighs {weight_n:.2f} N")
figure

# %% [markdown]
# ## How hard the servos work
#
# A servo gives torque only while its joint is away from its target, $\tau = k_p (c -
# q)$ at rest. So a hand that carries itself sags, and how near each servo is to its
# limit says how much is left for a step, which moves the load of one finger to the
# others.

# %%
joints = model.actuator_trnid[:, 0]
torque_nm = still.data.qfrc_actuator[model.jnt_dofadr[joints]]
used = 100 * np.abs(torque_nm) / model.actuator_forcerange[:, 1]
sag_deg = np.degrees(still.data.ctrl - still.data.qpos[model.jnt_qposadr[joints]])
labels = ("share of the torque limit [%]", "away from the target [°]")
figure, panels = panels_of(2, (9.4, 3.0))
for panel, values, label in zip(panels, (used, np.abs(sag_deg)), labels, strict=True):
    for number, colour in enumerate(FINGER_COLOURS):
        places = 5 * number + np.arange(4)
        panel.bar(places, values[4 * number : 4 * number + 4], color=colour)
        panel.text(places.mean(), 1.04 * values.max(), FINGERS[number], ha="center")
    panel.set(ylabel=label, xlabel="joint, from the palm outwards")
    panel.set_xticks([5 * n + k for n in range(5) for k in range(4)], list("1234") * 5)
    panel.set(ylim=(0, 1.15 * values.max()))
    panel.grid(axis="x", visible=False)
figure

# %% [markdown]
# ## A softer hand
#
# `hand.yaml` scales the vendor's gains. The paper's sweeps on the hand say 18.7, with a
# deviation of 2.5; here is what other gains make of the same targets. A hand that does
# not stand under them is refused by name, which is what the last line shows.


# %%
def with_gains(scale):
    """The hand with other position gains, at the vendor's damping ratio."""
    gains = {"stiffness_scale": scale, "damping_scale": scale**0.5}
    changed = {
        name: dataclasses.replace(getattr(hand, name), value=value, low=None, high=None)
        for name, value in gains.items()
    }
    return dataclasses.replace(hand, **changed)


scales = (5.0, 18.7, 60.0) if FAST else (5.0, 8.0, 12.0, 18.7, 30.0, 60.0)
hands = [settled(with_gains(scale)) for scale in scales]
heights_mm = [1e3 * float(after.data.body("palm").xpos[2]) for after in hands]
loads_n = np.array([carried_n(after) for after in hands])
figure, panels = panels_of(2, (9.4, 3.2))
panels[0].plot(scales, heights_mm, "o-", color=LINES[0])
for load, finger, colour in zip(loads_n.T, FINGERS, FINGER_COLOURS, strict=True):
    panels[1].plot(scales, load, "o-", color=colour, label=finger)
labels = ("height of the palm [mm]", "load [N]")
for panel, label in zip(panels, labels, strict=True):
    panel.axvspan(15.0, 22.0, color="#e8eef5")
    panel.set(xscale="log", xlabel="scale of the position gains [1]", ylabel=label)
    panel.set_xticks(scales, [f"{scale:g}" for scale in scales])
    panel.minorticks_off()
panels[1].legend(ncol=3, loc="upper center", bbox_to_anchor=(0.5, 1.3))
figure

# %%
try:
    stance_of(with_gains(0.1))
except ValueError as refused:
    print(refused)

# %% [markdown]
# The band is what the paper's sweeps allow. Within it neither the height nor who
# carries how much changes much: the stance forgives a wrong gain. Walking does not,
# which is why training draws gains anew in every world (`fingers train crawl --help`,
# settings below `env.randomize`).
