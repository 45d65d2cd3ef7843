"""A sweep of 84 pretended trainings with faults in six of them."""

import pytest
from support.sweep_setup import plan_faults, run_fake, states, summaries

from fingers_mjx.studies.sweep.report import report
from fingers_mjx.studies.sweep.run import SweepFull


@pytest.mark.slow
def test_of_84_members_six_meet_every_kind_of_fault(tmp_path):
    """The disk that is full is emptied before the second start; the others stay so."""
    size = {"configurations": {f"c{n}": {} for n in range(7)}, "seeds": 12}
    lasting = {
        "c0/3": ["nan"],
        "c1/0": 9 * ["exception"],
        "c2/11": 9 * ["killed"],
        "c3/5": 9 * ["memory"],
        "c4/7": 9 * ["hang"],
    }
    root = tmp_path / "faults"
    plan_faults(root, lasting | {"c6/6": ["full"]})
    with pytest.raises(SweepFull, match="no room"):
        run_fake(root, **size)
    manifest = run_fake(root, **size)
    found = states(manifest)
    assert {k for k, state in found.items() if state != "done"} == set(lasting)
    assert len(found) == 84 and found["c0/3"] == "diverged"
    causes = ["iteration 2", "no such thing", "SIGKILL", "Out of memory", "hung"]
    lines = report(root, manifest)
    for member, cause in zip(lasting, causes, strict=True):
        [line] = [x for x in lines if x.startswith(f"missing: {member} ")]
        assert cause in line and "train, iteration 2" in line
    run_fake(tmp_path / "none", **size)
    faultless, ours = summaries(tmp_path / "none"), summaries(root)
    assert len(ours) == 79 and ours == {k: faultless[k] for k in ours}
