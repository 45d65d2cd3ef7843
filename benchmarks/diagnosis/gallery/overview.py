"""The page that gathers all records of the gallery, in Markdown.

`benchmarks.diagnosis.gallery.page` writes it: what counts and what is named are read
off the rows, robots and documented causes off the records.
"""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence

from benchmarks.diagnosis.gallery.record import Record

RIGHT, WRONG, OPEN = "right", "wrong", "open"

TEXT = """\
# Records of other people's robots

Public logs whose authors say what is in them. The rule was fixed before any was
diagnosed:

- The documented cause, where it is written and which effects of the catalogue count as
  right stand in `benchmarks/diagnosis/gallery/records`; they were written down before a
  verdict was looked at.
- The nominal simulation is what the authors publish (masses, rotors, gains), without
  the documented cause.
- **Right** is a record whose named set (causes, and what the records do not distinguish
  from them) contains a documented effect. A cause that is named and is none of them is
  **wrong**. All else is **open**.
- Twelve records of two kinds, seven arms and five pendulums and servos; of each kind
  three were drawn (`numpy.random.default_rng(20261123)`, a permutation of the sorted
  names) for development. The others are for one look at the end. A first draw over all
  twelve had put every pendulum into one half; it was drawn again by kind before any
  record was run.

```sh
python -m benchmarks.diagnosis.gallery --folder clones --fetch --out {rows}
python -m benchmarks.diagnosis.gallery.page {rows}
```

`--fetch` clones the repositories; nothing of them is part of this project. The second
command writes this page and those of the records, where all sizes are, what the authors
have and remarks. In the tables, "no effect likelier" counts, of the joints with the
documented cause, those in which no effect at all has more than half of the probability.

## Looked at once, at the end

{second}
Asked for is 75 %. Verdicts and probabilities are those of the first look (two busy
cores). How probabilities are formed was changed afterwards, for what the TX40 showed,
and much else for other reasons: [the same records again](gallery_again.md), with later
code. The loaders were written without a diagnosis, checked by
regressing the measured effort on the nominal mechanism alone. That changed two rows
before the look: the KR300's wrist moves its load, so that all six axes are in, and its
authors' friction is mostly Coulomb and viscous (350 to 540 N·m, of which 4 to 18 depend
on the direction), which count as right, too; the TX40's "currents" have the size of
torques at the motors.

{second_table}

Sizes are those of the authors in three of six axes of the KR300, two of six joints of
the TX40 and two of seven of the Franka; the pages compare them.

What the rule does not count:
{beside}.
Two of these are one thing under another name (Stribeck friction of a speed that no
motion reaches, and hysteresis over some milliradians, are dry friction); those of the
AIRBOT come from masses that are off by half, where the diagnosis allows 5 %.

## For development

{first}
They were looked at again and again (two cores of an AMD EPYC), so they say what the
diagnosis does, not how good it is:

{first_table}

The limit of speed that is named of the STS3250 is in the servo, by its maker, and not
among the parameters of the authors. In four joints of the Rokae dry friction of the
documented size is called `hysteresis` or `asymmetric_friction`.

The first answers about four of them were worse: `load_friction` of the pendulum, and
for the UR10e a `joint_coupling`; Rokae and Miuzei were first run afterwards. **The
nominal masses of the UR10e were changed after its first answer was seen**: those of the
maker's URDF, which are 20 % off, for those that the authors identified without the
load. What they led to is in the [reference](../reference/diagnosis.md): tolerances that
hold without repeats, friction that must predict the torque too, one load over joints,
and what a load's inertia does to the joints before it.
"""


def overview(records: Mapping[str, Record], rows: Sequence[dict]) -> str:
    """Returns the page in Markdown.

    Args:
        records: by name.
        rows: what the diagnosis said, one of every record.
    """
    pairs = [(records[row["record"]], row) for row in rows]
    first = [(record, row) for record, row in pairs if record.half == "first"]
    second = [(record, row) for record, row in pairs if record.half == "second"]
    return TEXT.format(
        rows="benchmarks/results/gallery.jsonl",
        first=_counts(first),
        first_table=_table(first),
        second=_counts(second),
        second_table=_table(second),
        beside=_beside(second),
    )


def rating(row: dict) -> str:
    """Returns what a row counts as by the rule of the page.

    Args:
        row: what the diagnosis said of a record.
    """
    if row["right"]:
        return RIGHT
    return WRONG if row["verdict"] in ("found", "ambiguous") else OPEN


def _counts(own: Sequence[tuple[Record, dict]]) -> str:
    """How many are right, first in the list, wrong and open, and of which commits."""
    count = Counter(rating(row) for _, row in own)
    first = sum(row["first"] for _, row in own)
    commits = " and ".join(sorted({row["commit"] for _, row in own}))
    return (
        f"Of these {len(own)} **the documented cause is named in {count[RIGHT]}, first "
        f"in {first}**; {count[WRONG]} wrong, {count[OPEN]} open (commit {commits})."
    )


def _beside(own: Sequence[tuple[Record, dict]]) -> str:
    """How many of the right ones name what nobody documents."""
    right = [(record, row) for record, row in own if row["right"]]
    more = sum(bool(_split(record, row)[1]) for record, row in right)
    return (
        f"beside a documented cause {more} of the {len(right)} name others that nobody "
        "documents"
    )


def _table(own: Sequence[tuple[Record, dict]]) -> str:
    """All records of a half, the right ones first."""
    order = (RIGHT, WRONG, OPEN)
    lines = [
        "| record | robot | the authors say | by the rule | documented causes that are "
        "named | no effect likelier | other causes |",
        "|---|---|---|---|---|---|---|",
    ]
    own = sorted(own, key=lambda one: (order.index(rating(one[1])), one[0].name))
    return "\n".join([*lines, *(_line(*one) for one in own)])


def _line(record: Record, row: dict) -> str:
    documented, others = _split(record, row)
    alike = not_distinguished(e for e in row["alike"] if e in record.effects)
    said = rating(row)
    cells = (
        f"[`{record.name}`](gallery/{record.name}.md)",
        record.robot,
        record.documented,
        f"{f'**{said}**' if said == RIGHT else said}: `{row['verdict']}`",
        "; ".join([*named_effects(documented, sizes=True), *alike]) or "–",
        _likelier(row, documented or (row["causes"] if alike else [])),
        "; ".join(named_effects(others, sizes=False)) or "–",
    )
    return f"| {' | '.join(cells)} |"


def _split(record: Record, row: dict) -> tuple[list[dict], list[dict]]:
    """Causes that are documented, and the others."""
    kinds: tuple[list[dict], list[dict]] = ([], [])
    for cause in row["causes"]:
        kinds[cause["effect"] not in record.effects].append(cause)
    return kinds


def not_distinguished(effects: Iterable[str]) -> list[str]:
    """Returns how effects are named that records do not separate from a cause.

    Args:
        effects: their names.
    """
    return [f"`{effect}`, not distinguished" for effect in effects]


def named_effects(causes: Sequence[dict], sizes: bool) -> list[str]:
    """Returns each effect with its joints, or how often it is named.

    Args:
        causes: of one row.
        sizes: whether that of an effect that is named once stands beside it.
    """
    by_name: dict[str, list[dict]] = {}
    for cause in causes:
        by_name.setdefault(cause["effect"], []).append(cause)
    said = []
    for name, (one, *more) in by_name.items():
        where = "all joints" if one["where"] == "all" else one["where"]
        size = f", {_size(one)}" if sizes and not more else ""
        said.append(f"`{name}` in {f'{len(more) + 1} joints' if more else where}{size}")
    return said


def _size(cause: dict) -> str:
    """Sizes of a cause with their 95 % intervals."""
    return ", ".join(
        f"{e['value']:.3g} ({e['low']:.3g} to {e['high']:.3g}) {e['unit']}"
        for e in cause["parameters"].values()
    ).replace("-", "−")


def _likelier(row: dict, causes: Sequence[dict]) -> str:
    """In how many of the joints with these causes no effect is likelier than not."""
    said = row["posterior"]
    nothing = {h["joint"]: h["probability"] for h in said if h["effects"] == []}
    joints = {joint for cause in causes for joint in _joints(cause, row)}
    count = sum(nothing.get(joint, 0.0) > 0.5 for joint in joints)
    return f"{count} of {len(joints)}" if joints else "–"


def _joints(cause: dict, row: dict) -> list[str]:
    every = sorted({h["joint"] for h in row["posterior"]})
    return every if cause["where"] == "all" else cause["where"].split(" and ")
