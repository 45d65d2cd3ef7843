"""Latched faults: once found they stay, and grow more severe by the table."""

from dataclasses import dataclass

from fingers_robot.safety.table import BY_ID
from fingers_robot.safety.types import Found, Reaction


@dataclass(frozen=True, slots=True)
class Fault:
    """A latched fault.

    Attributes:
        id: its row of the table.
        first_s: when it was found [s].
        detail: what was found then.
        reaction: what it calls for by now; never falls.
    """

    id: str
    first_s: float
    detail: str
    reaction: Reaction

    def __str__(self) -> str:
        return f"{self.id} {BY_ID[self.id].name}: {self.detail}"


def latch(
    faults: tuple[Fault, ...], found: Found, t: float
) -> tuple[tuple[Fault, ...], tuple[str, ...]]:
    """Adds what was found and lets the latched faults grow.

    Args:
        faults: the latched faults, in the order in which they were found.
        found: what this step found, by row of the table.
        t: monotonic time [s].

    Returns:
        The latched faults, and one line for each change.
    """
    lines: list[str] = []
    grown = tuple(_grow(fault, fault.id in found, t, lines) for fault in faults)
    known = {fault.id for fault in faults}
    new = tuple(
        Fault(name, t, detail, BY_ID[name].reaction)
        for name, detail in found.items()
        if name not in known
    )
    lines += [f"{fault} -> {fault.reaction.name.lower()}" for fault in new]
    return grown + new, tuple(lines)


def severest(faults: tuple[Fault, ...]) -> Reaction:
    """The most severe reaction that any latched fault calls for."""
    return max((fault.reaction for fault in faults), default=Reaction.NONE)


def _grow(fault: Fault, present: bool, t: float, lines: list[str]) -> Fault:
    row = BY_ID[fault.id]
    if row.worse is None or fault.reaction >= row.worse:
        return fault
    if t - fault.first_s < row.after_s or (row.lasting and not present):
        return fault
    lines.append(f"{fault.id} {row.name} -> {row.worse.name.lower()}")
    return Fault(fault.id, fault.first_s, fault.detail, row.worse)
