"""Hidden joints with a velocity loop, from the record to the verdict."""

from dataclasses import replace

import pytest

from benchmarks.diagnosis.hidden.believed import believed, true_parameters
from benchmarks.diagnosis.hidden.cases import drawn_case
from benchmarks.diagnosis.hidden.conditions import Conditions
from sysid.diagnosis.diagnose import diagnose


def case_of(seed, effects=(), effort=True):
    """A short record, at 15 Hz of low-pass."""
    short = Conditions(rig="cascade", round_s=6.0, lowpass_hz=15.0, effort=effort)
    return drawn_case(seed, effects, "medium", short)


def known(case, effort=True, **drive):
    """What is believed, with fields of the drive changed."""
    mechanism = believed(case.stand, effort)
    changed = replace(mechanism.drives[case.joint], **drive)
    return replace(mechanism, drives={case.joint: changed})


def test_a_right_simulation_of_two_loops_lacks_nothing():
    """Negative control: described by two gains the same record is not explained."""
    case = case_of(4)
    said = diagnose(case.logs, known(case))
    assert (said.verdict, said.causes) == ("none", ())
    two_gains = diagnose(case.logs, known(case, cascade=None))
    assert two_gains.verdict == "unexplained"


def test_friction_behind_two_loops_is_named():
    case = case_of(2, ("coulomb_friction",))
    said = diagnose(case.logs, known(case))
    assert said.verdict == "found"
    assert [cause.effect for cause in said.causes] == ["coulomb_friction"]
    found = said.causes[0].parameters["torque_nm"]
    truth = true_parameters(case, "coulomb_friction")["torque_nm"]
    assert found.value == pytest.approx(truth, rel=0.1)
    assert found.low < truth < found.high


@pytest.mark.slow
@pytest.mark.parametrize("effort", [True, False])
@pytest.mark.parametrize("seed", range(1, 6))
def test_no_seed_names_what_is_not_there(seed, effort):
    case = case_of(seed, effort=effort)
    said = diagnose(case.logs, known(case, effort))
    assert (said.verdict, said.causes) == ("none", ())
