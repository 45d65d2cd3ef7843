# %% [markdown]
# # Rewards as a library
#
# Every reward term is a pure function of arrays of one hand. This notebook makes its
# own arrays; there is no simulation and no environment in it. It draws the springs of
# the footprint objective, shows what the lift estimator sees in five kinds of motion,
# asks for gradients, and puts terms together in a table whose weights change during
# training.

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
import jax
import jax.numpy as jnp
import matplotlib as mpl
import numpy as np

import rewards
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
FINGERS = ("thumb", "index", "middle", "ring", "little")

# %% [markdown]
# ## Springs to the footprint
#
# The footprint objective ties each fingertip to its place in the stance by a spring
# that is four times softer forwards than sideways and upwards, $E = \sum_j (p_j -
# p^*_j)^\top W (p_j - p^*_j)$ with $W = \mathrm{diag}(¼, 1, 1)$. Here are five stance
# targets and a hand whose tips are somewhere else, in millimetres in the frame V of the
# palm.

# %%
stance_v = 1e-3 * jnp.array(
    [
        [20, 35, -120],
        [55, 36, -120],
        [117, 19, -120],
        [60, -24, -120],
        [18, -40, -120.0],
    ]
)
moved_v = stance_v + 1e-3 * jnp.array(
    [[-14, 12, 0], [16, 4, 9], [20, 0, 2], [-18, 3, 0], [6, -15, 12.0]]
)
energy_m2, slope_m = jax.value_and_grad(rewards.footprint_departure)(moved_v, stance_v)
of_each = jax.vmap(lambda p, goal: rewards.footprint_departure(p[None], goal[None]))
share = of_each(moved_v, stance_v) / energy_m2

# %% [markdown]
# Width of a spring: how much of the penalty it has. Arrows: minus the gradient, which
# is where the reward pulls the tip. It is not the way back to the stance: the soft axis
# is x, so that a tip may swing forwards and backwards and is held sideways.

# %%
figure, panels = panels_of(2, (9.2, 3.9))
for panel, axis, name in zip(panels, (1, 2), ("y left", "z up"), strict=True):
    for tip, (finger, colour) in enumerate(zip(FINGERS, FINGER_COLOURS, strict=True)):
        ends = 1e3 * np.stack([stance_v[tip], moved_v[tip]])[:, [0, axis]]
        pull = -0.6e3 * np.asarray(slope_m[tip])[[0, axis]]
        panel.plot(*ends.T, color=colour, lw=1 + 14 * float(share[tip]), alpha=0.35)
        panel.plot(*ends[0], "o", mfc="white", mec=colour, ms=8)
        panel.plot(*ends[1], "o", color=colour, ms=7, label=finger)
        arrow = {"arrowstyle": "-|>", "color": INK, "lw": 1.3}
        panel.annotate("", ends[1] + pull, ends[1], arrowprops=arrow)
    panel.set(xlabel="x forward [mm]", ylabel=f"{name} [mm]")
    panel.margins(0.12)
panels[0].set(title="from above", aspect="equal")
panels[1].set(title="from the side, heights three times as large", aspect=3)
panels[1].set_ylim(-126, -103)
handles, labels = panels[0].get_legend_handles_labels()
figure.legend(handles, labels, loc="outside lower center", ncols=5)
figure.suptitle("○ stance   ● fingertip   → pull of the footprint objective")
figure

# %% [markdown]
# `vmap` turns one hand into many. About two thousand displaced hands show the shape of
# one spring: the lines of equal penalty are ellipses, twice as long as wide.

# %%
side = 25 if FAST else 45
grid_mm = np.linspace(-30, 30, side)
x_mm, y_mm = np.meshgrid(grid_mm, grid_mm)
departures = jnp.asarray(np.stack([x_mm, y_mm, 0 * x_mm], -1).reshape(-1, 1, 3) / 1e3)
penalty = jax.jit(jax.vmap(rewards.footprint_departure, (0, None)))
surface = -30 * 0.02 * penalty(departures, jnp.zeros((1, 3))).reshape(side, side)

figure, (panel,) = panels_of(1, (5.4, 4.2))
filled = panel.contourf(x_mm, y_mm, 1e3 * np.asarray(surface), 12, cmap="Blues_r")
figure.colorbar(filled, label="reward of one step [10⁻³]")
panel.set(xlabel="x forward [mm]", ylabel="y left [mm]", aspect="equal")
panel.set_title("One spring at weight −30, Δt = 20 ms")
figure

# %% [markdown]
# ## What the lift estimator sees
#
# The lift objective starts the gait: it pays for vertical tip motion *at the stepping
# frequency that the command asks for*. A phase turns at $f(|v_\mathrm{cmd}|)$; the
# tip's vertical velocity $u$, turned back by that phase, goes into a moving average $z$
# of 0.3 s. Motion at the frequency stands still in $z$, all other motion turns and
# averages away. Five tips do five different things under the command 0.10 m/s:

# %%
DT, SECONDS = 0.02, 6.0
command = jnp.array([0.10, 0.0])
params = rewards.LiftParams()
f_hz = float(rewards.lift_frequency_hz(jnp.linalg.norm(command), params))
t = DT * np.arange(round(SECONDS / DT))

MOTIONS = {  # name: frequency [Hz], amplitude of the velocity [m/s], how it touches
    "steps at the frequency": (f_hz, 0.05, "half"),
    "steps at half of it": (f_hz / 2, 0.05, "half"),
    "steps too small": (f_hz, 0.012, "half"),
    "shakes in contact": (f_hz, 0.05, "always"),
    "waves in the air": (f_hz, 0.05, "never"),
}
u_mps = np.stack([a * np.cos(2 * np.pi * f * t) for f, a, _ in MOTIONS.values()], 1)
down = np.stack(
    [
        {"half": np.sin(2 * np.pi * f * t) < 0, "always": t >= 0, "never": t < 0}[kind]
        for f, _, kind in MOTIONS.values()
    ],
    axis=1,
)
force_n = np.where(down, 1.6, 0.0)
f_hz

# %% [markdown]
# `lift_step` is for all tips of one hand and returns their sum. Given arrays of one
# tip, under `vmap`, it says what each tip earns; `lax.scan` runs it over time.


# %%
def lift_of_tips(u_mps, force_n):
    """Magnitude and average of each tip in each step; arrays are time × tips."""

    def of_one(u, force):
        def step(memory, now):
            memory, magnitude = rewards.lift_step(
                memory, now[0][None], now[1][None], command, DT, params
            )
            return memory, (magnitude, memory.average[0])

        return jax.lax.scan(step, rewards.init_lift_memory(tips=1), (u, force))[1]

    return jax.vmap(of_one, in_axes=1, out_axes=1)(u_mps, force_n)


paid, average = jax.jit(lift_of_tips)(jnp.asarray(u_mps), jnp.asarray(force_n))
size = np.linalg.norm(average, axis=-1)

# %%
figure, panels = panels_of(10, (9.2, 7.2), rows=5)
for tip, name in enumerate(MOTIONS):
    left, right = panels[2 * tip], panels[2 * tip + 1]
    colour = FINGER_COLOURS[tip]
    left.fill_between(
        t,
        0,
        1,
        where=down[:, tip],
        color="#e4e7eb",
        lw=0,
        transform=left.get_xaxis_transform(),
    )
    left.plot(t, 1e3 * u_mps[:, tip], color=colour, lw=1.2)
    left.set(ylim=(-60, 60), ylabel="u [mm/s]")
    left.set_title(name, loc="left")
    right.fill_between(
        t, 1e3 * np.asarray(paid[:, tip]), color=colour, alpha=0.35, lw=0, label="paid"
    )
    right.plot(t, 1e3 * size[:, tip], color=INK, lw=1.4, label="|z|")
    for height in (params.amplitude_low_mps, params.amplitude_high_mps):
        right.axhline(1e3 * height, color=GREY, lw=1, ls="--")
    right.set(ylim=(0, 30), ylabel="[mm/s]")
    mean = 1e3 * float(paid[:, tip].mean())
    right.set_title(f"paid on average: {mean:.1f} mm/s", loc="left")
panels[1].legend(ncols=2, loc="lower right", bbox_to_anchor=(1, 0.95))
panels[-1].set_xlabel("time [s]")
panels[-2].set_xlabel("time [s]   (grey: in contact)")
figure

# %% [markdown]
# The first tip is paid in full (upper dashed line, $z_\mathrm{max}$) whenever it is in
# the air. The second is just as fast, but at half the frequency most of its motion
# averages away; the third is in time but hardly above $z_\mathrm{min}$ (lower line).
# The last two have the perfect average and earn nothing: the gate asks for a tip that
# is in the air now and has touched the ground since the phase last wrapped.
#
# The average in the complex plane says the same in another way. At the frequency it
# goes to a fixed point, whose angle is the phase of the step; away from it, it runs in
# circles.

# %%
figure, panels = panels_of(2, (9.2, 3.9))
for tip, name in list(enumerate(MOTIONS))[:3]:
    panels[0].plot(
        *(1e3 * average[:, tip].T), color=FINGER_COLOURS[tip], lw=1, label=name
    )
    panels[0].plot(*(1e3 * average[-1, tip]), "o", color=FINGER_COLOURS[tip], ms=5)
turn = np.linspace(0, 2 * np.pi, 200)
for height in (params.amplitude_low_mps, params.amplitude_high_mps):
    ring = 1e3 * height * np.stack([np.cos(turn), np.sin(turn)])
    panels[0].plot(*ring, color=GREY, lw=1, ls="--")
panels[0].set(xlabel="Re z [mm/s]", ylabel="Im z [mm/s]", aspect="equal")
panels[0].set_title("average z over time; rings: z_min and z_max")
panels[0].legend(loc="upper left", fontsize=8)

tried_hz = np.linspace(0.2, 2 * f_hz, 60 if FAST else 160)
long_t = DT * np.arange(1500)
waves = jnp.asarray(np.cos(2 * np.pi * tried_hz * long_t[:, None]))
_, settled = jax.jit(lift_of_tips)(waves, jnp.zeros_like(waves))
gain = np.linalg.norm(settled, axis=-1)[-500:].mean(0)
alpha = DT / (DT + params.tau_s)
pole = (1 - alpha) * np.exp(-2j * np.pi * (tried_hz - f_hz) * DT)
panels[1].plot(tried_hz, gain, color=LINES[0], lw=2, label="measured")
panels[1].plot(
    tried_hz,
    0.5 * alpha / abs(1 - pole),
    color=INK,
    ls="--",
    lw=1.2,
    label="½ of a first-order filter",
)
panels[1].axvline(f_hz, color=GREY, lw=1)
panels[1].set(xlabel="frequency of the tip [Hz]", ylabel="mean |z| / amplitude of u")
panels[1].set_title(f"what passes at the command 0.10 m/s ({f_hz:.2f} Hz)")
panels[1].set_ylim(0, 0.56)
panels[1].legend(fontsize=8)
figure

# %% [markdown]
# ## Gradients
#
# The terms are safe under `grad`, through the memory as well. How should a tip that
# hardly moves change its motion to earn more lift over four seconds? The gradient of
# the whole return with respect to every sample of $u$ is a wave at the stepping
# frequency. Following it teaches the tip to step, without any policy.

# %%
span = t < 4.0
in_air = jnp.asarray(np.where(down[span, 0], 1.6, 0.0))[:, None]
rng = np.random.default_rng(0)
first = 0.015 * np.cos(2 * np.pi * f_hz * t[span]) + rng.normal(0, 0.01, span.sum())


def earned(u):
    """Lift magnitude of one tip, summed over time [m]."""
    return DT * jnp.sum(lift_of_tips(u[:, None], in_air)[0])


climb = jax.jit(jax.value_and_grad(earned))
u, history, slopes = jnp.asarray(first), [], []
for _ in range(8 if FAST else 25):
    value, slope = climb(u)
    history.append(float(value))
    slopes.append(np.asarray(slope))
    u = u + 0.05 * slope

# %%
figure, panels = panels_of(3, (9.2, 5.4), rows=3, shared=False)
panels[0].plot(t[span], 1e3 * first, color=GREY, lw=1.2, label="at first")
panels[0].plot(t[span], 1e3 * np.asarray(u), color=LINES[1], lw=1.4, label="in the end")
panels[0].set(ylabel="u [mm/s]", title="vertical velocity of the tip")
panels[0].legend(ncols=2, loc="upper right")
panels[1].plot(t[span], 1e3 * slopes[0], color=LINES[0], lw=1.4)
panels[1].set(ylabel="∂ return / ∂u [10⁻³ s]", xlabel="time [s]")
panels[1].set_title("gradient of the return at first")
panels[2].plot(1e3 * np.array(history), color=LINES[2], lw=2)
panels[2].set(xlabel="step of gradient ascent", ylabel="return [10⁻³ m]")
figure

# %% [markdown]
# ## A table, and weights that change
#
# A task's reward is a table of rows: name, kernel, weight or schedule, and the signals
# that it binds. Terms are logged with weight and time step in them, and their sum is
# the reward to the last bit. Three hands, one table of four rows; `vmap` again:

# %%
names = ("track_planar_velocity", "footprint", "direction", "vertical_velocity")
table = tuple(row for row in rewards.CRAWL if row.name in names)
weights = rewards.weights_at(rewards.table_weights(table), steps=0)

shift = jnp.array([0.0, 1.0, 1.0])[:, None, None] * (moved_v - stance_v)
forward = jnp.array([0.0, 0.09, 0.02])
hands = {
    "tip_pos_v": stance_v + shift,
    "footprint_target_v": jnp.broadcast_to(stance_v, (3, 5, 3)),
    "vel_v": jnp.stack([forward, 0 * forward, jnp.array([0.0, 0.0, 0.06])], -1),
    "command": jnp.tile(jnp.array([0.10, 0.0, 0.0]), (3, 1)),
    "tip_force_n": jnp.tile(jnp.array([0.0, 1.6, 0.0, 1.6, 1.6]), (3, 1)),
    "tip_vel_v": jnp.array([0.0, 0.1, -0.1])[:, None, None]
    * jnp.ones((3, 5, 1))
    * jnp.array([1.0, 0, 0]),
}
total, terms = jax.vmap(lambda hand: rewards.evaluate(table, hand, weights, DT))(hands)

figure, (left, right) = panels_of(2, (9.2, 3.6), shared=False)
who = ("stands still", "steps forwards", "swings backwards")
for row, (name, colour) in enumerate(zip(names, LINES, strict=False)):
    places = np.arange(3) + 0.18 * (row - 1.5)
    left.bar(
        places,
        1e3 * np.asarray(terms[name]),
        0.17,
        color=colour,
        label=name.replace("_", " "),
    )
left.plot(np.arange(3), 1e3 * np.asarray(total), "D", color=INK, label="reward")
left.axhline(0, color=INK, lw=0.8)
left.set(xticks=range(3), xticklabels=who, ylabel="[10⁻³] in one step")
left.set_title("terms of three hands, and their sum")
left.legend(fontsize=7.5)

steps = jnp.arange(0, 90_001, 300)
every = rewards.table_weights(rewards.CRAWL)
over_time = jax.vmap(lambda n: rewards.weights_at(every, n))(steps)
for name, colour in (("lift", LINES[0]), ("track_yaw_rate", LINES[1])):
    right.plot(steps, over_time[name], color=colour, lw=2, label=name.replace("_", " "))
right.set(ylim=(0, 6.6), yticks=[0, 0.5, 2, 4, 6.25])
right.set(xlabel="control steps of each environment", ylabel="weight")
right.set_title("two weights of the crawl task")
right.legend(fontsize=8)
assert np.array_equal(total, sum(terms[name] for name in sorted(terms)))
figure

# %% [markdown]
# Everything here was arrays in and numbers out: give the same functions the arrays of
# your own robot. `help(rewards)` lists all of them, and the pages of the [crawl
# task](../docs/reference/crawl.md) and of the [other tasks](../docs/guides/tasks.md)
# say which weights they have.
