# %% [markdown]
# # Reading a sweep: seeds, intervals, and what may be concluded
#
# `fingers sweep` trains configurations on several seeds, `fingers compare` says whether
# they differ. This notebook first makes such results by itself, with a difference
# that is known, so that one can see how often a conclusion from one, three or twelve
# seeds is right, and then reads a sweep that was trained: the paper's ablation, as
# far as it is there. Nothing is trained here; the statistics are those of
# `fingers compare`.

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
from pathlib import Path

import matplotlib as mpl
import numpy as np

import fingers_mjx
from fingers_mjx.reports.figures import GREY, INK, LINES, STYLE, panels_of
from fingers_mjx.studies.comparison.comparison import compared
from fingers_mjx.studies.comparison.figures import difference_dots, seed_dots
from fingers_mjx.studies.comparison.results import read_results
from fingers_mjx.studies.statistics.compare import difference
from fingers_mjx.studies.statistics.intervals import bca_interval, t_interval
from fingers_mjx.studies.statistics.pairs import pair
from fingers_mjx.studies.statistics.power import detectable
from fingers_mjx.studies.statistics.significance import holm, paired_p
from fingers_mjx.studies.sweep.manifest import read_manifest

mpl.rcParams.update(STYLE)
FAST = bool(os.environ.get("NOTEBOOK_FAST"))
rng = np.random.default_rng(0)

# %% [markdown]
# ## One sweep
#
# Twelve seeds of two configurations. A seed gives both the same first network and the
# same worlds, so part of what it does to a training is common to both (here 0.6 cm/s),
# and part is not (0.5 cm/s each). The true difference is 0.6 cm/s.

# %%
GAIN, COMMON, OWN, LEVEL = 0.6, 0.6, 0.5, 9.0


def trained(studies, seeds):
    """Task speeds [cm/s] of ours and the other, by study and seed."""
    common = LEVEL + COMMON * rng.normal(size=(studies, seeds))
    own = OWN * rng.normal(size=(2, studies, seeds))
    return common + own[0] + GAIN, common + own[1]


ours, other = (speeds[0] for speeds in trained(1, 12))
seeds = range(1, 13)
found = difference(
    pair(dict(zip(seeds, ours, strict=True)), dict(zip(seeds, other, strict=True))),
    better="higher",
)
figure, panels = panels_of(2, (9.2, 3.2))
for x, speeds, colour in ((0, other, GREY), (1, ours, LINES[0])):
    panels[0].plot(np.full(12, x), speeds, "o", color=colour, alpha=0.8)
for a, b in zip(other, ours, strict=True):
    panels[0].plot((0, 1), (a, b), color=GREY, lw=0.7, zorder=0)
panels[0].set(xlim=(-0.5, 1.5), xticks=(0, 1), ylabel="task speed [cm/s]")
panels[0].set_xticklabels(("other", "ours"))
order = np.argsort(ours - other)
panels[1].axvline(0, color=INK, lw=0.8)
panels[1].axvline(GAIN, color=LINES[1], lw=1, ls="--", label="true difference")
panels[1].plot((ours - other)[order], range(12), "o", color=LINES[0], label="a seed")
panels[1].plot((found.low, found.high), (-1.5, -1.5), color=INK, lw=2)
panels[1].plot(found.mean, -1.5, "D", color=INK, label="mean, 95 % interval")
panels[1].set(xlabel="ours less other, on the same seed [cm/s]", yticks=[])
panels[1].legend(loc="upper left")
print(
    f"difference {found.mean:+.2f} cm/s [{found.low:.2f}, {found.high:.2f}], "
    f"better on {found.in_favour} of {found.n} seeds, p = {found.p:.4f}; "
    f"twelve seeds show {found.detectable:.2f} cm/s in 80 % of studies"
)
figure

# %% [markdown]
# Points on the left overlap, lines mostly rise: what a seed has in common with itself
# goes away in the difference. That is why seeds are compared in pairs.
#
# ## How many seeds are enough
#
# The same study is made thousands of times. On the left, how often ours comes out ahead
# (the sign of the mean), and how often the interval excludes zero. With one seed there
# is no interval: the sign is wrong in every fifth study, and nothing warns of it. On
# the right, the difference that n seeds show in 80 % of studies.

# %%
STUDIES = 400 if FAST else 8000
counts = (1, 2, 3, 5, 8, 12, 16)
signs, shown, least = [], [], []
for n in counts:
    a, b = trained(STUDIES, n)
    signs.append(np.mean((a - b).mean(1) > 0))
    shown.append(np.mean(t_interval(a - b)[0] > 0) if n > 1 else np.nan)
    least.append(detectable(OWN * 2**0.5, n))
figure, panels = panels_of(2, (9.2, 3.0))
panels[0].plot(counts, 100 * np.array(signs), "o-", color=GREY, label="mean is ahead")
panels[0].plot(
    counts, 100 * np.array(shown), "o-", color=LINES[0], label="interval excludes 0"
)
panels[0].set(ylim=(0, 104), ylabel="studies [%]", xlabel="seeds")
panels[0].legend(loc="lower right")
panels[1].plot(counts, least, "o-", color=LINES[0])
panels[1].axhline(GAIN, color=LINES[1], lw=1, ls="--")
panels[1].text(16, GAIN + 0.08, "true difference", ha="right", color=LINES[1])
panels[1].set(ylim=(0, 3.2), ylabel="detectable [cm/s]", xlabel="seeds")
figure

# %% [markdown]
# ## Does an interval hold what it says?
#
# A 95 % interval should hold the truth in 95 of 100 studies. Student's does, at three
# seeds too. A bootstrap never goes beyond the few values that it resamples: three seeds
# are too few for it, also with levels that are widened for small samples.
# `fingers compare` prints both and puts Student's first.

# %%
few = (3, 5, 8, 12)
TRIED = 60 if FAST else 600
students, bootstraps = [], []
for n in few:
    a, b = trained(STUDIES, n)
    low, high = t_interval(a - b)
    students.append(np.mean((low < GAIN) & (high > GAIN)))
    low, high = bca_interval((a - b)[:TRIED])
    bootstraps.append(np.mean((low < GAIN) & (high > GAIN)))
figure, (panel,) = panels_of(1, (5.4, 2.9))
panel.axhline(95, color=INK, lw=0.8)
panel.plot(few, 100 * np.array(students), "o-", color=LINES[0], label="Student's t")
panel.plot(few, 100 * np.array(bootstraps), "o-", color=LINES[1], label="BCa bootstrap")
panel.set(ylim=(60, 100), ylabel="holds the truth [% of studies]", xlabel="seeds")
panel.legend(loc="lower right")
figure

# %% [markdown]
# ## Twenty measures, one of them by chance
#
# Who looks at twenty measures of two equal configurations finds one with p < 0.05 in
# most studies. Holm's correction, over all that are read together, keeps that at
# 5 %; it is what `fingers compare` prints when several comparisons are on one page.

# %%
noise = rng.normal(size=(200 if FAST else 2000, 20, 12))
p = paired_p(noise)
lucky, corrected = p.min(1), np.array([holm(row).min() for row in p])
bins = np.linspace(0, 1, 41)
figure, (panel,) = panels_of(1, (6.4, 2.9))
panel.hist(lucky, bins, color=LINES[1], alpha=0.8, label="smallest of 20, as it is")
panel.hist(corrected, bins, color=LINES[0], alpha=0.6, label="with Holm's correction")
panel.axvline(0.05, color=INK, lw=0.8)
panel.set(xlabel="smallest p of a study without any difference", ylabel="studies")
panel.legend()
print(
    f"below 0.05: {100 * np.mean(lucky < 0.05):.0f} % of studies, "
    f"{100 * np.mean(corrected < 0.05):.0f} % with the correction"
)
figure

# %% [markdown]
# ## A sweep that was trained
#
# `benchmarks/results/ablation_third` has trainings with terms taken out of the reward
# of crawling. Each dot is one of 147 M control steps, evaluated in 256 randomized
# episodes. A rule was written down before: if fewer than ten of the twelve of `ours`
# reach 0.05 m/s, nothing is concluded. So short a training would show who finds a gait
# early rather than whose gait is better.

# %%
TREE = Path(fingers_mjx.__file__).parent.parent
ABLATION = TREE / "benchmarks/results/ablation_third"  # in a clone, not in a wheel
MEASURES = ("task_speed_mps", "five_finger_participation")
figure = None
if ABLATION.exists():
    results = read_results(ABLATION, read_manifest(ABLATION))
    trained_ones = compared(results, "ours", MEASURES)
    print(f"{results.members - len(results.missing)} of {results.members} members")
    speeds = list(results.values["ours"]["task_speed_mps"].values())
    walking = sum(speed >= 0.05 for speed in speeds)
    print(f"{walking} of {len(speeds)} of `ours` walk: ten of twelve were asked for")
    figure = seed_dots(trained_ones)
figure

# %% [markdown]
# The same as differences from `ours`, on the same seed. An interval that has zero does
# not show that there is no effect: it shows how large the effect may still be, and that
# so few seeds do not separate a centimetre per second from nothing.

# %%
if ABLATION.exists():
    for row in trained_ones.rows:
        found = row.difference
        if row.measure == "task_speed_mps" and found.low is not None:
            print(
                f"{row.configuration:22} {100 * found.mean:+5.1f} cm/s "
                f"[{100 * found.low:+5.1f}, {100 * found.high:+5.1f}], n = {found.n}, "
                f"p = {row.p_holm:.3f} (Holm), {100 * found.detectable:.1f} detectable"
            )
    figure = difference_dots(trained_ones)
figure

# %% [markdown]
# ## With a sweep of your own
#
# ```sh
# fingers sweep spec.yaml -o sweep
# fingers compare sweep --baseline stock
# ```
#
# writes the same figures for every measure, as a page, a table and JSON. How a sweep is
# described is in `docs/guides/studies.md`, each formula in
# `docs/reference/statistics.md`, and how often they are right in
# `docs/results/statistics.md`.
