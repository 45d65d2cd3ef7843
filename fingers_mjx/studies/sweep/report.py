"""What a sweep says at its end: what is done, what is missing and why, what is next."""

from pathlib import Path

from fingers_mjx.studies.sweep.manifest import Manifest, Member, number_of
from fingers_mjx.studies.sweep.outcome import last_lines
from fingers_mjx.studies.sweep.plan import LOG_FILE

LAST_LINES = 5


def report(root: Path, manifest: Manifest) -> list[str]:
    """Returns the lines of the report.

    Args:
        root: directory of the sweep, as the user gave it.
        manifest: at the end.
    """
    members, missing = manifest.members, manifest.missing()
    done = len(members) - len(missing)
    lines = [f"{done} of {number_of(len(members))} done"]
    for name in manifest.configurations:
        own = [m for m in members if m.configuration == name]
        done = [m for m in own if m.state == "done"]
        lines.append(f"  {name}: {len(done)} of {len(own)} seeds")
    for member in missing:
        lines += _missing(root, member)
    if len(missing) < len(members):
        baseline = manifest.configurations[0]
        lines.append(f"next: fingers compare {root} --baseline {baseline}")
    return lines


def _missing(root: Path, member: Member) -> list[str]:
    """Returns what is known of a member that is not done."""
    where = f"{member.stage}, iteration {member.iterations}"
    log = member.key.directory(root) / LOG_FILE
    return [
        f"missing: {member.key} ({member.state}; {where}; attempts: "
        f"{member.attempts}): {member.reason}",
        *[f"  | {line}" for line in last_lines(root, member.key, LAST_LINES)],
        f"  log: {log}",
    ]
