"""A member for which there is too little memory does not take the others along."""

import json
import os
import subprocess
import sys

import pytest
from support.sweep_setup import TINY, states, written

from envs.config.strict_yaml import write_yaml
from fingers_mjx.studies.sweep.manifest import read_manifest

MISSING = 5
"""Exit status, as the guide documents it."""
LIMIT_BYTES = 8 * 10**9
WORLDS = 1 << 18
"""Their data of one iteration are 16 GB in one piece."""
PROGRAM = """
import resource, sys
from fingers_mjx.cli.main import main
limit = int(sys.argv[1])
resource.setrlimit(resource.RLIMIT_AS, (limit, limit))  # of the workers, too
sys.exit(main(sys.argv[2:]))
"""


def limited(*argv):
    """Runs `fingers` in an address space that has an end."""
    return subprocess.run(
        [sys.executable, "-c", PROGRAM, str(LIMIT_BYTES), *map(str, argv)],
        env={**os.environ, "JAX_PLATFORMS": "cpu"},
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_a_member_without_memory_is_tried_twice_and_missed(tmp_path):
    """The one that fits, under the same limit, is the control."""
    spec, root = tmp_path / "spec.yaml", tmp_path / "sweep"
    sizes = {"fits": {}, "huge": {"num_envs": WORLDS}}
    few = {"set": TINY | {"iterations": 1}, "seeds": 1, "processes": 1}
    spec.write_text(write_yaml(written(configurations=sizes, **few)), "utf-8")
    done = limited("sweep", spec, "-o", root)
    manifest = read_manifest(root)
    assert states(manifest) == {"fits/0": "done", "huge/0": "failed"}, done.stderr
    assert done.returncode == MISSING
    fits, huge = manifest.members
    assert (fits.attempts, huge.attempts, huge.iterations) == (1, 2, 0)
    cause = "JaxRuntimeError: RESOURCE_EXHAUSTED: Out of memory allocating "
    assert huge.reason.startswith(cause)
    place = "huge/0 (failed; train, iteration 0; attempts: 2)"
    assert f"\nmissing: {place}: {cause}" in done.stdout
    summary = json.loads((root / fits.run / "eval/summary.json").read_text("utf-8"))
    assert summary["episodes"] == 4
