"""What an operator may type: a line becomes words for the supervisor, or a refusal."""

from dataclasses import dataclass

from fingers_robot.behaviour.heading import MOST_DEG, turn_of
from fingers_robot.behaviour.keyboard.keys import ARROWS

HELP = "type: arm, stop, off, clear, policy N, keys NAME …, turn DEGREES, status, quit"
URGENT = ("stop", "off", "quit")
MAX_KEYS = 64
"""Keys that one line may ask for, and that may wait for the policy."""
_PLAIN = ("arm", "clear", "status", *URGENT)
_SHOWN = 40


@dataclass(frozen=True, slots=True)
class Word:
    """One line that was understood.

    Attributes:
        kind: its first word; of a kind only the newest line counts.
        sends: what goes to the supervisor, in order.
    """

    kind: str
    sends: tuple[str, ...]


def parse(line: bytes, policies: int, holds: bool = False) -> Word | str:
    """Returns the word of a line, or the sentence by which it is refused.

    Args:
        line: without its end; bytes that are not ASCII are refused.
        policies: how many policies the run has.
        holds: whether it holds the heading, which a turn changes.
    """
    text = " ".join(line.decode("utf-8", "replace").split())
    kind, *rest = text.split(" ")
    if text in _PLAIN:
        return Word(text, () if text == "status" else (text,))
    if kind == "policy" and len(rest) == 1:
        return _policy(rest[0], policies)
    if kind == "keys" and 0 < len(rest) <= MAX_KEYS and set(rest) <= set(ARROWS):
        return Word("keys", tuple(f"key {name}" for name in rest))
    if kind == "turn" and len(rest) == 1:
        return _turn(rest[0], holds)
    return f"found {_shown(text)}; {HELP}"


def _policy(number: str, policies: int) -> Word | str:
    digits = number.isascii() and number.isdigit() and len(number) < 4
    if digits and int(number) < policies:
        return Word("policy", (f"policy {int(number)}",))
    valid = "0" if policies == 1 else f"0 to {policies - 1}"
    return f"found policy {_shown(number)}; valid: {valid}"


def _turn(degrees: str, holds: bool) -> Word | str:
    if not holds:
        return "found turn; valid with --heading-hold GAIN OFFSET"
    if turn_of(degrees) is None:
        valid = f"-{MOST_DEG:g} to {MOST_DEG:g} degrees, to the left positive"
        return f"found turn {_shown(degrees)}; valid: {valid}"
    return Word("turn", (f"turn {degrees}",))


def _shown(text: str) -> str:
    short = text if len(text) <= _SHOWN else text[: _SHOWN - 1] + "…"
    return short if short.isprintable() else ascii(short)[1:-1]
