"""Flags of XLA, which it reads once, when JAX first computes something."""

from collections.abc import MutableMapping, Sequence

VARIABLE = "XLA_FLAGS"


def add_flags(environment: MutableMapping[str, str], flags: Sequence[str]) -> None:
    """Adds flags; one that is set already stays as it is.

    Args:
        environment: variables of the process.
        flags: each `--name=value`.
    """
    given = environment.get(VARIABLE, "").split()
    names = {flag.split("=")[0] for flag in given}
    new = [flag for flag in flags if flag.split("=")[0] not in names]
    environment[VARIABLE] = " ".join(given + new)
