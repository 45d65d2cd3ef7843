"""Evaluation of a trained policy wherever it is kept, and what is written of it."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import jax
import numpy as np
from matplotlib.figure import Figure

from envs.batch import BatchEnv
from envs.physics.room import ROOM, too_little_room
from fingers_mjx.evaluation.evaluate import (
    Episodes,
    EpisodeTable,
    Measuring,
    Progress,
    evaluate,
)
from fingers_mjx.evaluation.files import (
    SUMMARY_FILE,
    TABLE_FILE,
    summary_document,
    write_summary,
    write_table,
)
from fingers_mjx.evaluation.measures import CONTACT_N
from fingers_mjx.evaluation.setups import with_fields
from fingers_mjx.policy.actor import acting_together
from fingers_mjx.policy.digest import digest
from fingers_mjx.policy.source import PolicySource
from fingers_mjx.reports import figures
from fingers_mjx.reports.page import commit_here
from fingers_mjx.runs.machine import machine
from fingers_mjx.runs.setup import make_env

MAX_WORLDS = 4096
GAIT_S = 8.0
"""Stretch of an episode that the gait diagram shows [s]."""


def evaluate_source(
    source: PolicySource,
    episodes: int,
    seed: int = 0,
    backend: str = "cpu",
    steps: int | None = None,
    progress: Progress | None = None,
) -> EpisodeTable:
    """Runs the deterministic policy in `episodes` randomized worlds of its task.

    Args:
        source: policy; its setup is what is simulated.
        episodes: number of episodes, each in a world of its own.
        seed: of worlds, commands and noise.
        backend: physics backend.
        steps: control steps of an episode; as in training if not given.
        progress: called with (steps done, steps in all).

    Raises:
        InputError: settings that do not fit, or too little space for the contacts: what
            is measured without some of them is no result.
    """
    setup = source.setup
    if steps is not None:
        setup = with_fields(setup, episode_s=steps * setup.env.control_dt_s)
    # What a fallen hand does does not count, so there is no need to set it up again.
    batch = make_env(setup, min(episodes, MAX_WORLDS), backend, auto_reset=False)
    table = evaluate(
        batch,
        # As when several are evaluated together: alike to the last bit on the CPU.
        acting_together([source.network]),
        Episodes(episodes, batch.episode_length, jax.random.key(seed)),
        measuring(batch),
        progress,
    )
    check_room(table, setup.env)
    return table


def check_room(table: EpisodeTable, config: Any) -> None:
    """Checks that there was space for all contacts.

    Args:
        table: of an evaluation.
        config: settings of its task.

    Raises:
        InputError: something was dropped in a step that counts.

    Source:
        Ours.
    """
    episodes = [table.episode(index) for index in range(table.traces.done.shape[1])]
    hit = np.array([one.overflow.any(axis=0) for one in episodes])
    for metric, count in zip(ROOM, hit.sum(axis=0), strict=True):
        if count:
            what = metric.removesuffix("_overflow")
            source = f"evaluation: {what}s dropped in {count} of {len(hit)} episodes"
            raise too_little_room(source, metric, config, " (with --set)")


def measuring(batch: BatchEnv) -> Measuring:
    """Returns what is measured in `batch`; the mass is without the task's bodies."""
    mass_kg = float(batch.mj_model.body_subtreemass[batch.spec.palm_body])
    return Measuring(mass_kg, batch.task.episode_measures)


def summary(
    source: PolicySource, columns: Mapping[str, np.ndarray], seed: int
) -> dict[str, Any]:
    """Returns the summary of a policy's episodes for JSON.

    Args:
        source: policy.
        columns: measure name to one value per episode.
        seed: of the evaluation.
    """
    task, steps = source.setup.train.task, source.steps_trained
    found = summary_document(columns, task, source.name, seed, steps, commit_here())
    return {**found, "policy_sha256": digest(source.network), "machine": machine()}


def document(
    source: PolicySource,
    table: EpisodeTable,
    seed: int,
    conditions: Mapping[str, Any],
) -> dict[str, Any]:
    """Returns the summary of an evaluation for JSON.

    Args:
        source: policy.
        table: its episodes.
        seed: of the evaluation.
        conditions: what else it takes to repeat it, as plain data.
    """
    found = summary(source, table.columns, seed)
    return {**found, "conditions": dict(conditions)}


def write_evaluation(
    directory: Path, table: EpisodeTable, about: Mapping[str, Any]
) -> None:
    """Writes summary, table of episodes and plots.

    Args:
        directory: made if missing; other files in it stay.
        table: the episodes.
        about: from `document`.
    """
    directory.mkdir(parents=True, exist_ok=True)
    notes = {k: str(v) for k, v in about.items() if k != "measures"}
    write_table(directory / TABLE_FILE, table.columns | table.worlds, notes)
    for name, figure in evaluation_figures(table).items():
        figure.savefig(directory / f"{name}.png")
    write_summary(directory / SUMMARY_FILE, about)


def evaluation_figures(table: EpisodeTable) -> dict[str, Figure]:
    """Returns gait, foot paths and tracking; of single episodes the most typical."""
    index = typical_episode(table)
    trace = jax.tree.map(np.asarray, table.episode(index))
    contact = trace.tip_force_n >= CONTACT_N
    span = slice(round(GAIT_S / table.dt_s))
    where = f"episode {index}"
    return {
        "gait": figures.gait_diagram(
            contact[span], table.dt_s, f"Gait diagram, {where}"
        ),
        "feet": figures.foot_trajectories(trace.tip_pos_v[span], contact[span]),
        "tracking": figures.tracking(table.columns),
        "tracking_in_time": figures.tracking_in_time(
            trace.command,
            trace.vel_v,
            trace.yaw_rate,
            table.dt_s,
            f"Velocity of {where} against its command",
        ),
    }


def typical_episode(table: EpisodeTable) -> int:
    """Returns the number of the longest episode with the median task speed."""
    speed, length = (table.columns[k] for k in ("task_speed_mps", "duration_s"))
    longest = np.flatnonzero(length >= length.max())
    known = longest[np.isfinite(speed[longest])]
    if not len(known):
        return int(longest[0])
    return int(known[np.argsort(speed[known], kind="stable")[len(known) // 2]])
