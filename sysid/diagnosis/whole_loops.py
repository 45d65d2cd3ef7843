"""Compiles the loops of a diagnosis as one function each."""

import os
from collections.abc import MutableMapping

from envs.config.xla_flags import add_flags

WHOLE_LOOPS = (
    "--xla_backend_extra_options=xla_cpu_small_while_loop_byte_threshold=1000000000"
)


def compile_loops_whole(environment: MutableMapping[str, str] = os.environ) -> None:
    """Asks XLA for one function for each loop over time, on the CPU.

    On the CPU XLA runs the body of a loop as dozens of small functions, one call each,
    but compiles a loop whole where a step touches less than about 1 kB. A minute of a
    joint is 240,000 steps, and such a call costs more than the dozens of numbers in it:
    whole, a simulation is nine times as fast and the equations along a record 2.6
    times. Not for training: a loop that is compiled whole uses one core, and no
    library for products of matrices.

    To be called before JAX computes anything: XLA reads it once, so `diagnose` cannot
    do it. An option of that kind that is set already stays, and a JAX that does not
    know it ignores it.

    Args:
        environment: variables of the process.
    """
    add_flags(environment, [WHOLE_LOOPS])
