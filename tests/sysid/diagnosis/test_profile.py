"""A servo that goes to its targets with an acceleration of its own is recognized."""

import pytest

from benchmarks.diagnosis.hidden.believed import believed, true_parameters
from benchmarks.diagnosis.hidden.cases import drawn_case
from benchmarks.diagnosis.hidden.conditions import Conditions
from sysid.diagnosis.diagnose import diagnose

EFFECT, NAME = "acceleration_limit", "acceleration_rad_s2"


@pytest.mark.parametrize(
    ("rig", "effort"),
    [("pendulum", True), pytest.param("axis", False, marks=pytest.mark.slow)],
)
def test_an_acceleration_is_named_with_its_size(rig, effort):
    once = Conditions(rig, 15.0, effort, rate_hz=100.0, repeats=False, round_s=6.0)
    case = drawn_case(21, (EFFECT,), "strong", once)
    said = diagnose(list(case.logs), believed(case.stand, effort))
    assert [cause.effect for cause in said.causes] == [EFFECT]
    found = said.causes[0].parameters[NAME]
    true = true_parameters(case, EFFECT)[NAME]
    assert found.value == pytest.approx(true, rel=0.1)
    assert found.unit == "rad/s²"
