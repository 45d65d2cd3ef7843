"""Loops that XLA compiles as one function each."""

import os
import subprocess
import sys
import textwrap

from envs.config.xla_flags import VARIABLE
from sysid.diagnosis.whole_loops import WHOLE_LOOPS, compile_loops_whole


def test_an_option_that_is_set_stays():
    environment = {VARIABLE: "--xla_backend_extra_options=own=1 --other=1"}
    compile_loops_whole(environment)
    assert environment[VARIABLE].split() == [
        "--xla_backend_extra_options=own=1",
        "--other=1",
    ]


def test_option_is_asked_for_once():
    environment = {}
    compile_loops_whole(environment)
    compile_loops_whole(environment)
    assert environment[VARIABLE] == WHOLE_LOOPS


def test_this_jax_knows_the_option_and_finds_the_same():
    """It marks the loop, in the one process and not in the other."""
    found = [_compiled(""), _compiled("compile_loops_whole()")]
    assert [line.split()[0] for line in found] == ["False", "True"]
    assert found[0].split()[1] == found[1].split()[1]


def _compiled(first):
    """Whether a loop of 512 numbers a step is compiled whole, and what it finds."""
    code = f"""
        from sysid.diagnosis.diagnose import diagnose  # which computes nothing yet
        from sysid.diagnosis.whole_loops import compile_loops_whole
        {first}
        import jax, jax.numpy as jnp
        def step(carry, x):
            return 0.5 * carry + x, carry
        def loop(xs):
            return jax.lax.scan(step, xs[0], xs)[1]
        xs = jnp.arange(2.0**19).reshape(-1, 512)
        program = jax.jit(loop).lower(xs).compile()
        print("xla_cpu_small_call" in program.as_text(), float(program(xs).sum()))
    """
    code = textwrap.dedent(code)
    environment = {**os.environ, VARIABLE: "", "JAX_PLATFORMS": "cpu"}
    command = [sys.executable, "-c", code]
    return subprocess.run(
        command, capture_output=True, text=True, check=True, env=environment
    ).stdout
