"""Programs are compiled while candidates of the equations are fitted.

A fit is one step after the other, many of which fill one core, and a program takes as
long to compile as to run thirty times. Nothing depends on when that is done.
"""

from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager

from sysid.diagnosis.fits.equations import LEFT_OUT, compile_equations
from sysid.diagnosis.fits.lanes import FEW_LANES, LANES
from sysid.diagnosis.fits.problem import Problem
from sysid.diagnosis.fits.programs import APART, COSTLY, program_of
from sysid.diagnosis.simulated.closed_loop import compile_simulation
from sysid.diagnosis.simulated.output_error import output_problem
from sysid.diagnosis.simulated.play import NAME as PLAY

_SHARED = tuple(name for name in COSTLY if name not in APART)

LIKELY = (
    ((), False, FEW_LANES),
    ((), True, FEW_LANES),
    (_SHARED, False, LANES),
    ((), False, LANES),
    (_SHARED, False, FEW_LANES),
    (COSTLY, False, FEW_LANES),
    (APART, False, FEW_LANES),
    (COSTLY, False, LANES),
    ((PLAY,), False, FEW_LANES),
    ((PLAY,), False, LANES),
)
"""Costly effects, whether readings are late, and candidates of the simulations that
most searches need where the angle decides, the first one first."""

SURE = 2
"""Number of those in front that a search needs, too, where the equations decide."""


@contextmanager
def compiled_ahead(problem: Problem) -> Iterator[None]:
    """Compiles what is likely to be asked for, beside what is done within.

    Args:
        problem: of a joint, which may be simulated.
    """
    space = problem.space
    with ThreadPoolExecutor(1) as thread:
        begun = [
            thread.submit(compile_equations, problem.data, space, kind)
            for kind in reversed(range(len(LEFT_OUT)))
        ]
        for costly, late, lanes in _likely(problem):
            what = problem, program_of(space, costly), late, lanes
            begun.append(thread.submit(compile_simulation, *what))
        try:
            yield
        finally:
            thread.shutdown(cancel_futures=True)  # one may be half done, 2 s at most
    for one in begun:
        if not one.cancelled():
            one.result()  # raises what it ended in


def _likely(problem: Problem) -> Sequence[tuple[tuple[str, ...], bool, int]]:
    if problem.known == "controller":
        return ()
    return LIKELY if output_problem(problem) else LIKELY[:SURE]
