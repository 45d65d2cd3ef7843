"""Films the policies of an iteration of training; the run's page shows them.

    python -m fingers_mjx.play.film_run ITERATION RUN…

`fingers train` starts it by `video_every`. An episode of the nominal hand in the
training environment, on C MuJoCo, under commands as in training.
"""

import os
import sys
from collections.abc import Sequence
from pathlib import Path

import jax
import numpy as np

from envs.batch import BatchEnv
from envs.rounding import fix_rounding
from fingers_mjx.evaluation.record import record
from fingers_mjx.evaluation.setups import nominal, without_practice
from fingers_mjx.play.keyboard_video import write_keyboard_video
from fingers_mjx.play.player import Played
from fingers_mjx.play.video import Film, write_video
from fingers_mjx.policy.actor import Policy, acting, load_policy
from fingers_mjx.runs.checkpoint import checkpoints
from fingers_mjx.runs.setup import make_env, run_setup
from fingers_mjx.runs.videos import policies_folder, video_file
from fingers_mjx.training.compile_cache import use_compile_cache
from fingers_mjx.training.run_page import write_run_page

SECONDS, FPS, WIDTH = 4.0, 12.5, 400
NICE = 10


def main(argv: Sequence[str] | None = None) -> None:
    """Films all runs that are named."""
    given = list(sys.argv[1:] if argv is None else argv)
    os.nice(NICE)
    fix_rounding()
    use_compile_cache()
    for run_dir in map(Path, given[1:]):
        film_run(run_dir, int(given[0]))
        write_run_page(run_dir)


def film_run(run_dir: Path, iteration: int) -> Path:
    """Writes the video of the networks that wait in a run directory.

    Args:
        run_dir: run directory.
        iteration: of the networks.

    Raises:
        InputError: no run directory, or no networks in it.
    """
    setup = without_practice(nominal(run_setup(run_dir)))
    env = make_env(setup, 1, "cpu", auto_reset=False)
    policy = load_policy(checkpoints(policies_folder(run_dir))[-1])
    played = episode(env, policy, round(SECONDS / env.dt))
    path = video_file(run_dir, iteration)
    path.parent.mkdir(exist_ok=True)
    film = Film(path, FPS, WIDTH, lambda done, count: None)
    if setup.train.task == "keyboard":
        return write_keyboard_video(film, env, played, None)
    return write_video(film, env, played)


def episode(env: BatchEnv, policy: Policy, steps: int) -> Played:
    """Plays one episode in the environment, to its end or for so many steps.

    Args:
        env: one world.
        policy: acts without noise.
        steps: control steps.
    """
    act, step = acting(policy), jax.jit(env.step)
    state = jax.jit(env.reset)(jax.random.key(0))
    poses, rows = [np.asarray(state.data.qpos[0])], []
    while len(rows) < steps and not (rows and rows[-1].done):
        state = step(state, act(state.obs))
        row = jax.tree.map(lambda x: np.asarray(x[0]), record(state))
        rows.append(row)
        poses.append(np.asarray(state.data.qpos[0]))
    trace = jax.tree.map(lambda *x: np.stack(x), *rows)
    return Played(trace, np.stack(poses), 0)


if __name__ == "__main__":
    main()
