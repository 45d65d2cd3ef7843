"""The table of `docs/reference/effects.md`, from the catalogue.

`python tests/support/effects_table.py` prints it.
"""

import math

from envs.actuator.catalogue import CATALOGUE


def table():
    """Returns the table in Markdown, one line per effect."""
    head = (
        "| effect | equation | parameters: unit, bounds, prior; vanishes at | source |"
    )
    rows = [head, "|---|---|---|---|"]
    for name, kind in CATALOGUE.items():
        parameters = "<br>".join(_parameter(k, p) for k, p in kind.parameters.items())
        cells = (f"`{name}`", kind.equation, parameters, kind.source)
        rows.append("| " + " | ".join(c.replace("|", "\\|") for c in cells) + " |")
    return "\n".join(rows) + "\n"


def _parameter(name, p):
    joined = " × / ÷ " if p.prior.kind == "lognormal" else " ± "
    prior = f"{p.prior.center:g}{joined}{p.prior.spread:g}"
    end = "" if p.identity is None else f"; {_identity(p.identity)}"
    return f"`{name}` {p.unit}, {p.low:g} to {p.high:g}, {prior}{end}"


def _identity(value):
    return "∞" if math.isinf(value) else f"{value:g}"


if __name__ == "__main__":
    print(table(), end="")
