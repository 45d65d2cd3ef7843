"""The evidence for sets of effects, on a search that is written down here."""

from types import SimpleNamespace

import pytest

from sysid.diagnosis.search.search import Search
from sysid.diagnosis.verdict.evidence import evidence

SAMPLES = 1000


def model(*effects, score):
    """A candidate without noise of its own: one sample counts as one."""
    return SimpleNamespace(
        effects=effects,
        score=score,
        noise_cost=0.0,
        correlation=1.0,
        variance=lambda samples: max(1.0, score / samples),
    )


def test_sets_are_weighed_against_the_chosen_one():
    base, best = model(score=1600.0), model("deadband", score=1000.0)
    other = model("backlash", score=1020.0)
    more = model("deadband", "armature", score=998.0)
    others = ({"deadband": [other]}, {"deadband": base}, [more])
    found = Search(None, base, best, *others, SAMPLES, None)
    said = evidence(found)
    assert set(said) == {(), ("deadband",), ("backlash",), ("armature", "deadband")}
    assert said["deadband",] == 0.0
    assert said["backlash",] == pytest.approx(-9.9, abs=0.05)  # ½ · 20 of noise 1
    assert said["armature", "deadband"] == pytest.approx(1.0, abs=0.01)
    assert said[()] == pytest.approx(-500.0 * 0.47, rel=0.01)  # ½ n log 1.6
