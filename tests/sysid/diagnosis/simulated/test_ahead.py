"""Programs that were compiled ahead are those that a search asks for."""

import re
from threading import Event

import jax
import pytest
from support.plain_servo import problem_with

from sysid.diagnosis.fits.equations import (
    LEFT_OUT,
    Evaluated,
    compile_equations,
    equation_errors,
)
from sysid.diagnosis.fits.lanes import FEW_LANES
from sysid.diagnosis.fits.programs import program_of
from sysid.diagnosis.simulated import ahead
from sysid.diagnosis.simulated.ahead import compiled_ahead
from sysid.diagnosis.simulated.closed_loop import compile_simulation, simulated

EFFECTS = (None, "backlash", "sensor_latency")
"""One with which a candidate is evaluated by each of `LEFT_OUT`."""


@pytest.fixture(scope="module")
def problem():
    return problem_with(row_s=0.004)


@pytest.fixture
def compiled(caplog):
    """Names of the functions that were compiled since."""
    jax.clear_caches()
    with jax.log_compiles():
        yield lambda: re.findall(r"Compiling (?:jit\()?(\w+)", caplog.text)


def shifted(problem, effect):
    theta = problem.space.nominal.copy()
    if effect:
        theta[problem.space.of(effect)[0]] += 0.2
    return theta[None]


@pytest.mark.parametrize("kind", range(len(LEFT_OUT)))
def test_equations_find_their_program(kind, problem, compiled):
    compile_equations(problem.data, problem.space, kind)
    before = compiled().count("equation_error")

    thetas = shifted(problem, EFFECTS[kind])
    equation_errors(problem.data, problem.space, thetas, Evaluated())

    assert (before, compiled().count("equation_error")) == (1, 1)


@pytest.mark.parametrize("late", [False, True])
def test_simulations_find_their_program(late, problem, compiled):
    program = program_of(problem.space, ())
    compile_simulation(problem, program, late, FEW_LANES)
    before = compiled().count("_simulated")

    simulated(problem, shifted(problem, "sensor_latency" if late else None))

    assert (before, compiled().count("_simulated")) == (1, 1)


def test_what_compiling_ends_in_is_raised(problem, monkeypatch):
    tried = Event()

    def fails(*_):
        tried.set()
        raise ValueError("no such program")

    monkeypatch.setattr(ahead, "compile_equations", fails)
    monkeypatch.setattr(ahead, "compile_simulation", lambda *_: None)
    with pytest.raises(ValueError, match="no such program"), compiled_ahead(problem):
        assert tried.wait(60)
