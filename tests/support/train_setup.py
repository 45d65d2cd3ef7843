"""A tiny run on a probe, for the tests of the driver; run as a script, it trains.

python train_setup.py RUN_DIR [--resume] [iterations=40 checkpoint_every=1 …]

With sleep_at=N it says so, and sleeps for ever, after iteration N.
"""

import dataclasses
import json
import os
import sys
import time
from pathlib import Path
from types import SimpleNamespace

from support.probe_envs import probe

from envs.hand.hand_file import load_hand_file
from fingers_mjx.ppo.config import PpoConfig, TrainConfig
from fingers_mjx.runs import checkpoint
from fingers_mjx.runs.metrics import read_metrics
from fingers_mjx.runs.setup import Setup
from fingers_mjx.training.errors import Interrupted
from fingers_mjx.training.train import Start, train

HAND = load_hand_file()
ROOT = Path(__file__).parents[2]
os.environ.setdefault("FINGERS_COMPILE_CACHE", str(ROOT / ".jax_cache"))

PPO = PpoConfig(
    unroll_length=4,
    epochs=2,
    minibatches=2,
    init_noise_std=0.5,
    actor_layers=(8,),
    critic_layers=(8,),
)
CONFIG = TrainConfig(
    task="probe",
    preset="cpu",
    num_envs=16,
    iterations=10,
    log_every=1,
    checkpoint_every=2,
    ppo=PPO,
)


def make_env(num_envs=CONFIG.num_envs):
    return probe("seen_action", num_envs, length=3)


def overflowing(room=48, num_envs=CONFIG.num_envs):
    """A probe that reports dropped contacts as an environment on Warp does."""
    env = make_env(num_envs)

    def with_metric(state):
        hit = (state.data["clock"] == 5) & state.data["hit"] & (room < 100)
        metrics = state.metrics | {"contact_overflow": hit * 1.0}
        return state.replace(metrics=metrics)

    return SimpleNamespace(
        num_envs=env.num_envs,
        action_size=env.action_size,
        observation_size=env.observation_size,
        reset=lambda key: with_metric(env.reset(key)),
        step=lambda state, action: with_metric(env.step(state, action)),
    )


def config(**changes):
    """Returns CONFIG with changes; "ppo" takes a dict of changes to the learner."""
    ppo = dataclasses.replace(PPO, **changes.pop("ppo", {}))
    return dataclasses.replace(CONFIG, ppo=ppo, **changes)


def setup(train_config=CONFIG, env=None):
    return Setup(train_config, env, HAND)


def run(path, resume=False, on_progress=lambda event: None, **changes):
    """Trains a probe at `path`; keywords change CONFIG."""
    made = config(**changes)
    env, start = make_env(made.num_envs), Start(resume)
    return train(env, setup(made), path, start=start, on_progress=on_progress)


def leaves(path):
    """Returns every array of the newest checkpoint, by name."""
    newest = checkpoint.newest(path / "checkpoints", print)
    return int(newest.name), checkpoint.load(newest).arrays


def assert_same_end(path, other):
    (iteration, one), (iteration_2, two) = leaves(path), leaves(other)
    assert iteration == iteration_2
    assert one.keys() == two.keys()
    differing = [k for k in one if one[k].tobytes() != two[k].tobytes()]
    assert differing == []


def curve(path, *metrics):
    rows = read_metrics(path / "metrics.jsonl")
    return [[row[name] for name in ("iteration", *metrics)] for row in rows]


def report(event):
    print(json.dumps(event), flush=True)
    if event["event"] == "progress" and event["iteration"] == SLEEP_AT:
        print(json.dumps({"event": "note", "text": "asleep"}), flush=True)
        time.sleep(3600.0)


if __name__ == "__main__":
    given = dict(word.split("=") for word in sys.argv[2:] if "=" in word)
    numbers = {name: int(value) for name, value in given.items()}
    SLEEP_AT = numbers.pop("sleep_at", -1)
    try:
        run(Path(sys.argv[1]), "--resume" in sys.argv, report, **numbers)
    except Interrupted as stopped:
        sys.exit(stopped.exit_code)
