"""MuJoCo Playground's environment of the hand in its own training wrappers."""

# pyright: reportMissingImports=false
from importlib.metadata import version

import jax
from mujoco_playground import wrapper

from benchmarks.comparison.workers.playground.hand import HandStand
from benchmarks.comparison.workers.report import STEPS_PER_CALL, arguments, serve


def main() -> None:
    """Builds the worlds and answers the command."""
    args = arguments()
    impl = args.backend
    env = wrapper.wrap_for_brax_training(HandStand(args.mjcf, impl, args.worlds))
    # MJX on JAX is slow on a GPU as well.
    repeat = STEPS_PER_CALL[args.device if impl == "warp" else "cpu"]

    @jax.jit
    def many(state, key):
        def body(state, key):
            action = 0.3 * jax.random.normal(key, (args.worlds, env.action_size))
            return env.step(state, action), None

        return jax.lax.scan(body, state, jax.random.split(key, repeat))[0]

    key = jax.random.PRNGKey(args.seed)
    state = jax.jit(env.reset)(jax.random.split(key, args.worlds))

    def call() -> int:
        jax.block_until_ready(many(state, key))
        return repeat * args.worlds

    about = f"playground {version('playground')}, mujoco-mjx {version('mujoco-mjx')}"
    about += f", jax {version('jax')}"
    serve(call, version=about, note=f"same hand standing, MJX on {impl}")


if __name__ == "__main__":
    main()
