"""Speed of many learners in one program against one learner, in turns in one run.

    python -m benchmarks.speed.population --backend warp 1x2048 12x2048 8x4096
    python -m benchmarks.speed.population --backend cpu --preset cpu 1x64 4x64

A size is members x worlds of each. Prints, for complete PPO iterations with the
networks of the preset, the time to the end of the first one, control steps per second
of all members together (median over rounds), and how many times faster that is than the
members trained one after the other by the first size, if that has one member of as many
worlds.
"""

import argparse
import dataclasses
import json
import os
import statistics
import time
from pathlib import Path

# MuJoCo Warp allocates beside JAX, which would otherwise take most of the memory.
os.environ.setdefault("XLA_PYTHON_CLIENT_PREALLOCATE", "false")

import jax

from benchmarks.speed.layers import call_by_substep
from benchmarks.speed.throughput import provenance
from envs.physics.backends import BACKENDS, default_backend
from fingers_mjx.ppo.config import PRESETS, preset
from fingers_mjx.runs.setup import Setup, make_env, new_setup, with_seed
from fingers_mjx.training.session import Session

ROUNDS = 5


class Timed:
    """A population that is advanced a few iterations at a time.

    Args:
        members: learners, of seeds 0, 1, ….
        worlds: of each.
        setup: settings of all.
        by_substep: whether JAX calls Warp once a physics step.

    Attributes:
        first_s: time to the end of the first iteration [s].
    """

    def __init__(self, members: int, worlds: int, setup: Setup, by_substep: bool):
        begin_s = time.monotonic()
        train = dataclasses.replace(setup.train, num_envs=worlds)
        setup = dataclasses.replace(setup, train=train)
        setups = [with_seed(setup, seed) for seed in range(members)]
        env = make_env(setup, members * worlds, setup.train.backend)
        if by_substep:
            call_by_substep(env)
        self.session = Session(env, setups)
        self.carry = self.session.start()
        self.steps = members * train.steps_per_iteration
        self.advance(1)
        self.first_s = time.monotonic() - begin_s

    def advance(self, iterations: int) -> float:
        """Does `iterations` and returns control steps of all worlds per second."""
        begin_s = time.monotonic()
        for _ in range(iterations):
            self.carry, _ = self.session.advance(self.carry)
        jax.block_until_ready(self.carry.train)
        return iterations * self.steps / (time.monotonic() - begin_s)


def main() -> None:
    """Times the sizes that were asked for and prints a line for each."""
    args = _arguments()
    config = dataclasses.replace(preset(args.preset), backend=args.backend)
    setup = new_setup(config, None)
    sizes = [(int(s.partition("x")[0]), int(s.partition("x")[2])) for s in args.sizes]
    timed = []
    for members, worlds in sizes:
        timed.append(Timed(members, worlds, setup, args.by_substep))
        print(f"{members}x{worlds}: first after {timed[-1].first_s:.0f} s", flush=True)
    rates: list[list[float]] = [[] for _ in sizes]
    for _ in range(ROUNDS):
        for one, found in zip(timed, rates, strict=True):
            found.append(one.advance(args.iterations))
    rows = []
    for (members, worlds), one, found in zip(sizes, timed, rates, strict=True):
        rate, alone = statistics.median(found), statistics.median(rates[0])
        gain = rate / alone if sizes[0] == (1, worlds) else None
        rows.append(
            {
                "members": members,
                "worlds": worlds,
                "first_s": one.first_s,
                "steps_per_s": rate,
                "gain": gain,
            }
        )
        more = f", {gain:.2f} times one after the other" if gain else ""
        print(f"{members:3} x {worlds:6}: {rate:12,.0f} steps/s{more}", flush=True)
    if args.json:
        record = {**provenance(), "sizes": rows}
        args.json.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=str(__doc__).partition("\n")[0])
    parser.add_argument("sizes", nargs="+", metavar="MEMBERSxWORLDS")
    parser.add_argument("--backend", choices=BACKENDS, default=default_backend())
    parser.add_argument("--preset", choices=PRESETS, default="paper")
    parser.add_argument("--iterations", type=int, default=5, help="per round")
    parser.add_argument(
        "--by-substep",
        action="store_true",
        help="warp: a call from JAX for each physics step, not each control step",
    )
    parser.add_argument("--json", type=Path)
    return parser.parse_args()


if __name__ == "__main__":
    main()
