"""What a diagnosis gains, over all seeds, from comparisons of some of them each.

python -m benchmarks.claims.gain PART/transfer.json... --out FILE

Joins what `fingers sysid transfer --policies` wrote, shows it as that does, and
writes it.
"""

import argparse
import json
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from envs.config.atomic_file import write_atomic
from envs.errors import InputError
from fingers_mjx.cli.sysid.transfer import print_gains
from fingers_mjx.studies.transfer import gains

FIELDS = ("conditions", "gain", "policies", "seeds")


def joined(parts: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """Returns one comparison of all pairs, numbered in the order of the parts.

    Args:
        parts: by name, documents of `fingers_mjx.studies.transfer.compared`.

    Raises:
        InputError: parts that were not compared alike: in other hands or episodes, of
            another task or budget; or a policy that is there twice, which is no seed
            more.
    """
    (first, one), *others = parts.items()
    for name, other in others:
        if _alike(other) != _alike(one):
            raise InputError(name, "conditions", _alike(other), f"as in {first}")
    documents = list(parts.values())
    values = {
        name: {
            arm: [x for part in documents for x in part["gain"][name]["values"][arm]]
            for arm in one["policies"]
        }
        for name in one["gain"]
    }
    policies = {
        arm: [x for part in documents for x in part["policies"][arm]]
        for arm in one["policies"]
    }
    for arm, every in policies.items():
        known = [policy["policy_sha256"] for policy in every]
        if len(set(known)) < len(known):
            raise InputError(arm, "policies", "one of them twice", "each one once")
    seeds = list(range(sum(len(part["seeds"]) for part in documents)))
    task = policies["default"][0]["task"]
    return {
        "seeds": seeds,
        "policies": policies,
        "gain": gains(values, seeds, task),
        "conditions": dict(one["conditions"]),
    }


def _alike(part: Mapping[str, Any]) -> tuple[object, ...]:
    """What has to be the same in all parts."""
    every = [policy for arm in part["policies"].values() for policy in arm]
    facts = {tuple(one[k] for k in ("task", "seed", "steps_trained")) for one in every}
    measures, arms = sorted(part["gain"]), sorted(part["policies"])
    return (sorted(part["conditions"].items()), sorted(facts), measures, arms)


def read(path: Path) -> dict[str, Any]:
    """Reads one comparison.

    Raises:
        InputError: no such file, or one that `fingers sysid transfer --policies` did
            not write.
    """
    valid = "a transfer.json of `fingers sysid transfer --policies`"
    try:
        document = json.loads(path.read_text("utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(path, "", error, valid) from error
    names = sorted(document) if isinstance(document, dict) else []
    missing = [name for name in FIELDS if name not in names]
    if missing:
        raise InputError(path, missing[0], f"only {names}", valid)
    return document


def main(words: Sequence[str] | None = None) -> int:
    """Joins the files of the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("parts", type=Path, nargs="+", metavar="transfer.json")
    parser.add_argument("--out", type=Path, required=True, metavar="FILE")
    args = parser.parse_args(words)
    try:
        document = joined({str(path): read(path) for path in args.parts})
    except InputError as error:
        print(f"gain: {error}", file=sys.stderr)
        return 2
    print_gains(document)
    write_atomic(args.out, json.dumps(document, indent=2, allow_nan=False))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
