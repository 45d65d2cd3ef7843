"""How well masses are known: what is a load with 5 % is none with 50 %.

The records are those of the hidden simulator; what is believed is changed afterwards.
"""

from dataclasses import replace

import pytest

from benchmarks.diagnosis.hidden.believed import believed
from benchmarks.diagnosis.hidden.cases import drawn_case
from benchmarks.diagnosis.hidden.conditions import Conditions
from sysid.diagnosis.diagnose import diagnose
from sysid.diagnosis.fits.space import SIGMA, make_space
from sysid.diagnosis.replay.track import all_tracks

USUAL = 0.05
"""Tolerance of a drive.yaml without `masses`."""


def pendulum(believed_share, tolerance, *effects):
    """A record, and a mechanism whose masses are that share of the true ones."""
    case = drawn_case(12, effects, "strong", Conditions(round_s=6.0))
    links = tuple(
        replace(
            link,
            mass=believed_share * link.mass,
            inertia=tuple(believed_share * x for x in link.inertia),
        )
        for link in case.stand.mechanism.links
    )
    mechanism = replace(case.stand.mechanism, links=links)
    known = {**case.stand.tolerances, "mass": tolerance}
    stand = replace(case.stand, mechanism=mechanism, tolerances=known)
    return list(case.logs), believed(stand)


def said(*case):
    found = diagnose(*pendulum(*case))
    return found.verdict, [c.effect for c in found.causes]


def test_masses_that_are_a_third_too_small_are_no_load_within_their_tolerance():
    assert said(0.7, 0.5) == ("none", [])


def test_masses_out_of_their_tolerance_are_named():
    """Negative control: with 5 % the same record shows a load."""
    assert said(0.7, USUAL) == ("found", ["payload_mass"])


def test_a_wide_tolerance_hides_no_other_effect():
    assert said(0.7, 0.5, "coulomb_friction") == ("found", ["coulomb_friction"])


@pytest.mark.parametrize(
    ("tolerance", "right"),
    [(0.01, ("found", ["payload_mass"])), (USUAL, ("none", []))],
)
def test_masses_that_are_well_known_show_a_small_load(tolerance, right):
    assert said(0.93, tolerance) == right


def test_one_tolerance_is_that_of_masses_rotor_and_load():
    """Ten times as wide; nothing else moves, and 5 % is what stands without it."""

    def deviations(tolerance):
        logs, mechanism = pendulum(1.0, tolerance)
        (drive,), (track,) = mechanism.drives.values(), all_tracks(logs, mechanism)
        space = make_space(track, drive, {"gravity": True})
        return {s.label: s.prior_sd for s in space.slots}

    usual, wide = deviations(USUAL), deviations(0.5)
    moved = {name for name in usual if wide[name] != usual[name]}
    assert moved == {"mass", "armature.inertia_kgm2", "payload_mass.mass_kg"}
    for name in moved:
        assert wide[name] == pytest.approx(10.0 * usual[name])
    assert usual["mass"] == SIGMA * 0.05
