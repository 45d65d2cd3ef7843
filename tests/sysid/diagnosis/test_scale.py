"""Another size of everything changes no verdict, and no bound of the hand applies."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.diagnosis.hidden.believed import believed, true_parameters
from benchmarks.diagnosis.hidden.cases import drawn_case
from benchmarks.diagnosis.hidden.conditions import Conditions
from sysid.diagnosis.diagnose import diagnose, problem_of
from sysid.diagnosis.replay.track import all_tracks
from sysid.diagnosis.search.settling import settled

SMALL = Conditions(round_s=5.0, lowpass_hz=15.0)


def case_of(factor, effects=("payload_mass",)):
    return drawn_case(11, effects, "strong", replace(SMALL, scale=factor))


def settled_problem(factor):
    case = case_of(factor)
    mechanism, logs = believed(case.stand), list(case.logs)
    track = all_tracks(logs, mechanism)[0]
    return settled(problem_of(track, logs, mechanism, False))


def test_the_search_sees_the_same_numbers_at_any_size():
    """Masses, torques and inertias times 1e-3 to 1e3: the same whitened residual."""
    problem, base = settled_problem(1.0)
    for factor in (1e-3, 1e3):
        other, model = settled_problem(factor)
        assert model.fit.cost == pytest.approx(base.fit.cost, rel=2e-4)
        # Rounding decides at which of two near optima a fold's fit ends.
        assert model.score == pytest.approx(base.score, rel=5e-3)
        assert np.allclose(model.fit.theta, base.fit.theta, atol=1e-2)
        for slot, same in zip(problem.space.slots, other.space.slots, strict=True):
            assert same.nominal == pytest.approx(slot.nominal, rel=1e-4, abs=1e-9)
            assert (same.low, same.high) == pytest.approx(
                (slot.low, slot.high), rel=1e-4
            )


def test_a_payload_of_kilograms_is_found():
    """The hand's payloads end at 0.6 kg; an arm's do not."""
    case = case_of(300.0)
    added = true_parameters(case, "payload_mass")["mass_kg"]
    assert added > 2.0
    said = diagnose(list(case.logs), believed(case.stand))
    assert said.causes[0].effect == "payload_mass"
    found = said.causes[0].parameters["mass_kg"]
    # A load is what the body weighs beyond a mass that is known to 5 %.
    unsure = 0.05 / np.sqrt(3.0) * case.stand.mechanism.links[-1].mass
    assert found.value == pytest.approx(added, abs=1.5 * unsure)
    assert found.low < added < found.high
    assert found.high - found.low > 2 * 2.5 * unsure


def test_the_load_of_an_arm_is_no_coupling():
    """The shoulder feels that it turns: a point would look like the elbow's pull."""
    arm = Conditions(rig="arm", rate_hz=100.0, lowpass_hz=15.0)
    case = drawn_case(11, ("payload_mass",), "strong", arm)
    said = diagnose(list(case.logs), believed(case.stand))
    assert [cause.effect for cause in said.causes] == ["payload_mass"]
    found = said.causes[0].parameters["mass_kg"]
    assert found.low < true_parameters(case, "payload_mass")["mass_kg"] < found.high
