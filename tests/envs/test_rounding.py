"""Settings that keep rounding apart from the size of a batch; see `test_contract`."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from envs import rounding
from envs.config.xla_flags import VARIABLE
from envs.rounding import WITHOUT_FMA, WITHOUT_YNN, fix_rounding


def pretend(monkeypatch, machine="x86_64", jaxlib="0.11.2"):
    monkeypatch.setattr(rounding.platform, "machine", lambda: machine)
    monkeypatch.setattr(rounding.metadata, "version", lambda name: jaxlib)


@pytest.mark.parametrize("jaxlib", ["0.8.1", "0.9.2", "0.11.1", "0.11.2"])
def test_only_flags_that_this_jaxlib_knows(monkeypatch, jaxlib):
    """It would end the process at any other."""
    pretend(monkeypatch, jaxlib=jaxlib)
    environment = {}
    fix_rounding(environment)
    new = [WITHOUT_YNN] if jaxlib.startswith("0.11") else []
    assert environment[VARIABLE].split() == [WITHOUT_FMA, *new]
    fix_rounding(environment)  # again changes nothing
    assert environment[VARIABLE].split() == [WITHOUT_FMA, *new]


def test_flags_that_are_set_stay(monkeypatch):
    pretend(monkeypatch)
    environment = {VARIABLE: "--xla_cpu_max_isa=AVX512 --other=1"}
    fix_rounding(environment)
    found = environment[VARIABLE].split()
    assert found == ["--xla_cpu_max_isa=AVX512", "--other=1", WITHOUT_YNN]


def test_other_processors_are_left_alone(monkeypatch):
    pretend(monkeypatch, machine="aarch64")
    environment = {}
    fix_rounding(environment)
    assert environment == {}


@pytest.mark.skipif(rounding.platform.machine() != "x86_64", reason="x86 only")
@pytest.mark.parametrize("rows", [1, 2, 4, 8, 16, 24, 64, 256])
def test_a_row_is_the_same_in_batches_of_any_usual_size(rows):
    """Products that are added, sums, elementary functions."""
    rng = np.random.default_rng(5)
    many = jnp.asarray(rng.normal(size=(2048, 20)), jnp.float32)

    @jax.jit
    def act(x):
        a, b = x[:, :10], x[:, 10:]
        turned = jnp.cos(a) * b - jnp.sin(b) * a
        kernel = jnp.exp(-jnp.sum(turned**2, axis=1) / 4.0)
        return turned + jnp.tanh(kernel)[:, None] * jnp.log(1.0 + a**2)

    np.testing.assert_array_equal(act(many[:rows]), act(many)[:rows])
