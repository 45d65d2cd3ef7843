"""Probabilities of sets of causes, from likelihoods that are written down here."""

import pytest

from sysid.diagnosis.verdict.posterior import named_sets, posterior
from sysid.diagnosis.verdict.wording import probable
from sysid.result import Hypothesis

FOUND = {(): -60.0, ("backlash",): -30.0, ("deadband",): 0.0}
NAMED = [("deadband",)]


def test_probabilities_add_up_to_one():
    assert sum(posterior(FOUND, NAMED, False).values()) == pytest.approx(1.0)


def test_what_the_verdict_names_is_probable():
    said = posterior(FOUND, NAMED, False)
    assert said["deadband",] > 0.6 > 0.4 > said[()]


def test_a_tie_is_shared():
    """Two effects that the records do not distinguish are as probable as each other."""
    even = {(): -60.0, ("sensor_latency",): 0.0, ("transport_delay",): 0.0}
    named = named_sets(["transport_delay"], [("sensor_latency", "transport_delay")])
    said = posterior(even, named, False)
    assert said["sensor_latency",] == pytest.approx(said["transport_delay",])
    assert said["sensor_latency",] > 0.4


def test_an_effect_that_gains_nothing_is_improbable():
    said = posterior({(): 0.0, ("deadband",): 0.5}, [()], False)
    assert said[()] > 0.9


def test_what_remains_speaks_for_none_of_these():
    clean, left = (posterior(FOUND, NAMED, x)[None] for x in (False, True))
    assert clean < 0.05 and left >= 0.5


def test_large_gains_are_tempered():
    """A hundredth of what is explained decides little, all of it much."""
    even = {(): -3000.0, ("backlash",): -30.0, ("deadband",): 0.0}
    alike = posterior(even, [], False)
    assert 1.0 < alike["deadband",] / alike["backlash",] < 1.5
    said = posterior(even, [("deadband",)], False)
    assert said["deadband",] > 0.8 > 0.05 > said[()]


def test_two_causes_that_explain_much_are_more_probable_than_none():
    """Each of them had cost a named set as much as one that nobody confirmed."""
    both = ("coulomb_friction", "viscous_friction")
    much = {(): -1000.0, ("viscous_friction",): -450.0, both: 0.0}
    said = posterior(much, [both], False)
    assert said[both] > 0.6 > 0.4 > said[()]


def test_only_joints_that_may_have_an_effect_are_spoken_of():
    said = [
        Hypothesis("a", (), 0.95),
        Hypothesis("a", ("deadband",), 0.05),
        Hypothesis("b", ("armature", "deadband"), 0.6),
        Hypothesis("b", None, 0.4),
        Hypothesis("c", (), 0.7),
    ]
    assert probable(said) == [
        ("b", "armature and deadband", 0.6),
        ("b", "none of these", 0.4),
        ("c", "no effect", 0.7),
    ]
