"""The hand file of a diagnosis: training takes it, whatever was found."""

import numpy as np
import pytest

from envs.actuator.catalogue import CATALOGUE
from envs.hand.hand_file import load_hand_file, save_hand_file
from sysid.diagnosis.replay.effects import joint_effects
from sysid.diagnosis.verdict.hand import extended_hand
from sysid.mechanism import hand_mechanism
from sysid.result import Cause, Diagnosis, Estimate

HAND = load_hand_file()


def diagnosis(effect, where="finger2_joint3", **values):
    units = CATALOGUE[effect].units()
    found = {k: Estimate(v, 0.9 * v, 1.1 * v, units[k]) for k, v in values.items()}
    other = "finger2_joint4" if effect == "joint_coupling" else ""
    cause = Cause(effect, where, found, 100.0, other)
    return Diagnosis("found", (cause,), (), None, "", ("ab" * 32,), 0, 1.0)


def middle(effect):
    return {
        name: float(np.clip(p.prior.center + 0.1 * p.prior.spread, p.low, p.high))
        for name, p in CATALOGUE[effect].parameters.items()
    }


@pytest.mark.parametrize("effect", joint_effects())
def test_written_and_read(effect, tmp_path):
    found = diagnosis(effect, "finger2_joint3", **middle(effect))
    hand = extended_hand(HAND, found)
    assert hand != HAND
    save_hand_file(hand, tmp_path / "hand.yaml")
    assert load_hand_file(tmp_path / "hand.yaml") == hand
    assert "identified from abab" in (tmp_path / "hand.yaml").read_text()
    assert hand.effects[-1:] == () or hand.effects[-1].other == found.causes[0].other


def test_figures_of_the_joint_change():
    before, after = (
        hand_mechanism(h).drives["finger2_joint3"]
        for h in (HAND, extended_hand(HAND, diagnosis("stiffness", scale=1.3)))
    )
    assert after.kp.value == pytest.approx(1.3 * before.kp.value)
    rest = hand_mechanism(extended_hand(HAND, diagnosis("stiffness", scale=1.3)))
    assert (
        rest.drives["finger2_joint2"].kp
        == hand_mechanism(HAND).drives["finger2_joint2"].kp
    )


def test_a_delay_of_one_joint_adds_to_that_of_the_hand():
    base = HAND.delay_s.value
    hand = extended_hand(HAND, diagnosis("transport_delay", delay_s=base + 0.01))
    effect = hand.effects[-1]
    assert effect.parameters["delay_s"].value == pytest.approx(0.01)
    whole = diagnosis("transport_delay", "all", delay_s=base + 0.01)
    assert extended_hand(HAND, whole).delay_s.value == pytest.approx(base + 0.01)


def test_what_lies_outside_of_the_range_is_said():
    hand = extended_hand(HAND, diagnosis("coulomb_friction", torque_nm=1e6))
    figure = hand.effects[-1].parameters["torque_nm"]
    assert figure.value == CATALOGUE["coulomb_friction"].parameters["torque_nm"].high
    assert "found 1e+06" in figure.note
