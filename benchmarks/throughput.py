"""Throughput of bare physics, environment and PPO of the same model in one run.

    python benchmarks/throughput.py --backend cpu --num-envs 1024
    python benchmarks/throughput.py --backend warp --num-envs 8192 --json warp.json

Prints control steps per second (four physics steps each) and the ratios to bare
physics, which is native batch stepping: `mujoco.batch.Batch` for cpu, MuJoCo Warp
replaying a CUDA graph for warp, a scan of `mjx.step` for jax. All layers step hands
that stand in the stance, with small random actions where a layer takes actions.
"""

import argparse
import json
import platform
import time
from collections.abc import Callable
from pathlib import Path

import jax
import jax.numpy as jnp
import mujoco
import numpy as np

from envs.batch import BatchEnv
from envs.crawl import CrawlEnv
from envs.physics import BACKENDS, default_backend
from envs.randomize import model_fields

ACTION_STD = 0.3


def main() -> None:
    """Runs the layers that were asked for and prints the table."""
    args = _arguments()
    env = CrawlEnv(backend=args.backend, num_worlds=args.num_envs)
    batch = BatchEnv(env, args.num_envs)
    layers = {
        "bare physics": lambda: _bare(env, args),
        "physics through JAX": lambda: _through_jax(env, args),
        "environment": lambda: _environment(batch, args),
        "PPO": lambda: _ppo(batch, args),
    }
    rates, first = {}, {}
    for name in args.layers or layers:
        start = time.perf_counter()
        call, steps = layers[name]()
        call()
        first[name] = time.perf_counter() - start
        rates[name] = _rate(call, steps * args.num_envs, args.seconds)
        ratio = rates[name] / rates.get("bare physics", rates[name])
        print(
            f"{name:22} {rates[name]:12,.0f} control steps/s"
            f"  {ratio:5.2f} of bare  first call {first[name]:5.1f} s",
            flush=True,
        )
    _write(args, rates, first)


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--backend", choices=BACKENDS, default=default_backend())
    parser.add_argument("--num-envs", type=int, default=1024)
    parser.add_argument("--seconds", type=float, default=5.0, help="per layer")
    parser.add_argument("--layers", nargs="*", help="default: all")
    parser.add_argument("--json", type=Path)
    return parser.parse_args()


def _rate(call: Callable[[], None], steps: int, seconds: float) -> float:
    """Median rate over repeated calls that fill `seconds`."""
    rates: list[float] = []
    end = time.perf_counter() + seconds
    while len(rates) < 3 or time.perf_counter() < end:
        start = time.perf_counter()
        call()
        rates.append(steps / (time.perf_counter() - start))
    return float(np.median(rates))


def _bare(env: CrawlEnv, args: argparse.Namespace) -> tuple[Callable[[], None], int]:
    """Native batch stepping with the controls of the stance."""
    if args.backend == "cpu":
        return _bare_cpu(env, args.num_envs)
    if args.backend == "warp":
        return _bare_warp(env, args.num_envs)
    return _through_jax(env, args)


def _bare_cpu(env: CrawlEnv, worlds: int) -> tuple[Callable[[], None], int]:
    batch = mujoco.batch.Batch(env.mj_model, worlds)
    batch.qpos, batch.ctrl = env.stance.qpos, np.array(env.stance.target_rad)

    def call() -> None:
        for _ in range(5):
            batch.step(nstep=env.physics.n_substeps)

    return call, 5


def _bare_warp(env: CrawlEnv, worlds: int) -> tuple[Callable[[], None], int]:
    import warp as wp
    from mujoco.mjx.third_party import mujoco_warp as mjw

    data = mujoco.MjData(env.mj_model)
    data.qpos[:], data.ctrl[:] = env.stance.qpos, env.stance.target_rad
    mujoco.mj_forward(env.mj_model, data)
    model_w = mjw.put_model(env.mj_model)
    data_w = mjw.put_data(
        env.mj_model, data, nworld=worlds, naconmax=48 * worlds, njmax=128
    )
    mjw.step(model_w, data_w)
    with wp.ScopedCapture() as capture:
        for _ in range(env.physics.n_substeps):
            mjw.step(model_w, data_w)

    def call() -> None:
        for _ in range(50):
            wp.capture_launch(capture.graph)
        wp.synchronize()

    return call, 50


def _through_jax(env: CrawlEnv, args: argparse.Namespace) -> tuple[Callable, int]:
    """The physics backend as the environment calls it, with randomized models."""
    repeat = 20
    worlds = jax.vmap(env.reset)(jax.random.split(jax.random.key(0), args.num_envs))
    ctrl = jnp.tile(jnp.array(env.stance.target_rad), (env.physics.n_substeps, 1))

    def one(variation: object, data: object) -> object:
        fields = model_fields(env.mj_model, env.spec, variation)
        return env.physics.step(fields, data, ctrl).state

    @jax.jit
    def many(variation: object, data: object) -> object:
        step = jax.vmap(one)
        return jax.lax.fori_loop(0, repeat, lambda _, d: step(variation, d), data)

    variation = worlds.memory.lasting.variation
    return lambda: jax.block_until_ready(many(variation, worlds.data)), repeat


def _environment(batch: BatchEnv, args: argparse.Namespace) -> tuple[Callable, int]:
    """Complete environment steps with small random actions."""
    repeat = 20

    @jax.jit
    def many(state: object, key: jax.Array) -> object:
        def body(carry: object, key: jax.Array) -> tuple[object, None]:
            shape = (args.num_envs, batch.action_size)
            return batch.step(carry, ACTION_STD * jax.random.normal(key, shape)), None

        return jax.lax.scan(body, state, jax.random.split(key, repeat))[0]

    state = jax.jit(batch.reset)(jax.random.key(0))
    return lambda: jax.block_until_ready(many(state, jax.random.key(1))), repeat


def _ppo(batch: BatchEnv, args: argparse.Namespace) -> tuple[Callable, int]:
    """Complete PPO iterations with the paper's networks and epochs."""
    from fingers_mjx.ppo import compile_iterations, make_iteration
    from fingers_mjx.ppo_config import PpoConfig
    from fingers_mjx.ppo_state import init_train_state, make_learner

    config = PpoConfig()
    learner = make_learner(batch, config)
    iterate = compile_iterations(make_iteration(batch, learner))
    carry = [
        init_train_state(learner, batch, jax.random.key(0)),
        jax.jit(batch.reset)(jax.random.key(1)),
        jax.random.key(2),
    ]

    def call() -> None:
        *carry[:], _ = iterate(*carry)
        jax.block_until_ready(carry[0])

    return call, config.unroll_length


def _write(
    args: argparse.Namespace, rates: dict[str, float], first: dict[str, float]
) -> None:
    if not args.json:
        return
    record = {
        "backend": args.backend,
        "num_envs": args.num_envs,
        "device": str(jax.devices()[0]),
        "cpu": platform.processor() or platform.machine(),
        "jax": jax.__version__,
        "mujoco": mujoco.__version__,
        "control_steps_per_s": rates,
        "first_call_s": first,
    }
    args.json.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
