"""The diagnosis finds what another simulator hides; a part of the battery, drawn anew.

The whole battery is `make battery`; what it measured is in docs/results/diagnosis.md.
"""

import dataclasses
import json
import random
import re

import jax
import numpy as np
import pytest

from benchmarks.diagnosis.hidden.believed import believed
from benchmarks.diagnosis.hidden.cases import draw_case
from benchmarks.diagnosis.hidden.recording import standard
from benchmarks.diagnosis.hidden.sampling import Noise, record
from benchmarks.diagnosis.hidden.sizes import SCALES
from benchmarks.diagnosis.hidden.stands import make_stand
from benchmarks.diagnosis.hidden.truth import OUTSIDE, Mechanism
from envs.hand.hand_file import load_hand_file
from fingers_mjx.cli.main import main
from fingers_mjx.training.compile_cache import SWITCH
from sysid.diagnosis.diagnose import diagnose
from sysid.drive import Nominal
from sysid.logs.log import MeasuredLog, make_log
from sysid.logs.read import write_log

SEED = random.SystemRandom().randrange(10**6)
ROUND_S = 6.0
"""Shorter than in the whole battery, and on the pendulum, which shows most effects."""
SHOWN = [n for n, s in SCALES.items() if n not in OUTSIDE and "pendulum" in s.kinds]


def found_in(case):
    return diagnose(list(case.logs), believed(case.stand), seed=case.seed)


def names_of(said):
    same = {a.effect for a in said.alternatives if not a.distinguishable}
    return {c.effect for c in said.causes[:1]} | same


def test_a_part_of_the_battery():
    """Three hidden effects and a record without, drawn at random: most are right.

    A diagnosis that always says nothing, or names everything, is right once at most.
    """
    print("seed", SEED)
    rng = np.random.default_rng(SEED)
    right = {}
    for k, name in enumerate(rng.choice(SHOWN, 3, replace=False).tolist()):
        magnitude = ("medium", "strong")[k % 2]
        case = draw_case(SEED + k, (name,), magnitude, round_s=ROUND_S)
        named = names_of(found_in(case))
        right[name] = name in named and len(named) <= 3
    right["none"] = not found_in(draw_case(SEED + 10, round_s=ROUND_S)).causes
    assert sum(right.values()) >= 2, (SEED, right)


def changed(log: MeasuredLog, change, units=None) -> MeasuredLog:
    header = log.header
    columns = {}
    for name, values in log.columns.items():
        renamed, x = change(name, np.asarray(values))
        columns[renamed] = x
    return make_log(
        header.joints,
        log.t_s,
        columns,
        units or header.units,
        palm_quat_w=header.palm_quat_w,
        source="changed",
    )


@pytest.fixture(scope="module")
def lopsided():
    """A record of a lopsided pendulum, what is believed of it, and the verdict."""
    effect = ("asymmetric_viscous",)
    case = draw_case(17, effect, "strong", round_s=ROUND_S)
    mechanism = believed(case.stand)
    return case.logs[0], mechanism, diagnose([case.logs[0]], mechanism)


def test_mirrored_records_flip_the_sign_of_an_asymmetry(lopsided):
    log, mechanism, first = lopsided
    mirrored = changed(log, lambda name, x: (name, -x))
    second = diagnose([mirrored], mechanism)
    assert first.causes[0].effect == second.causes[0].effect == "asymmetric_viscous"
    one, two = (d.causes[0].parameters["difference_nms"].value for d in (first, second))
    assert one == pytest.approx(-two, rel=0.02)
    assert abs(one) > 0.0


def test_another_unit_of_the_effort_changes_nothing(lopsided):
    """Currents at half a newton metre per ampere instead of torques."""
    log, mechanism, first = lopsided
    amperes = changed(
        log,
        lambda n, x: (n.replace("tau", "cur"), 2.0 * x if "tau" in n else x),
        {"cmd": "rad", "pos": "rad", "cur": "A"},
    )
    drive = mechanism.drives["servo"]
    scale = Nominal(0.5, drive.effort_scale.tolerance)
    other = dataclasses.replace(drive, effort="cur", effort_scale=scale)
    second = diagnose(
        [amperes], dataclasses.replace(mechanism, drives={"servo": other})
    )
    assert first.verdict == second.verdict
    assert first.causes
    for one, two in zip(first.causes, second.causes, strict=True):
        assert one.effect == two.effect
        for name, estimate in one.parameters.items():
            assert two.parameters[name].value == pytest.approx(estimate.value, rel=1e-2)


def twins(friction_of: int):
    """Two equal pendulums side by side; one of them has dry friction."""
    rng = np.random.default_rng(5)
    stand = make_stand("pendulum", rng, 15.0)
    link, joint = stand.mechanism.links[0], stand.mechanism.joints[0]
    links = tuple(dataclasses.replace(link, name=n) for n in ("left", "right"))
    plain = Mechanism(links, (joint, joint))
    both = np.repeat(stand.middle, 2), np.repeat(stand.reach, 2)
    stand = dataclasses.replace(
        stand, mechanism=plain, moved=(0, 1), middle=both[0], reach=both[1]
    )
    truth = plain.with_effect(friction_of, "coulomb_friction", torque_nm=0.03)
    moves = standard(rng, *both, round_s=6.0, rounds=2)
    return stand, record(truth, moves, Noise(stalls=0), rng)


def test_the_verdict_moves_with_the_joint():
    for number, name in enumerate(("left", "right")):
        stand, log = twins(number)
        said = diagnose([log], believed(stand))
        assert [(c.effect, c.where) for c in said.causes] == [
            ("coulomb_friction", name)
        ]


@pytest.fixture
def cache(tmp_path, monkeypatch):
    """A place of its own for compiled programs."""
    before = jax.config.jax_compilation_cache_dir  # pyright: ignore
    monkeypatch.setenv(SWITCH, str(tmp_path / "compiled"))
    yield str(tmp_path / "compiled")
    jax.config.update("jax_compilation_cache_dir", before)


def test_files_of_a_diagnosis(tmp_path, capsys, cache):
    """Verdict, report and a hand file that loads; the same verdict again."""
    case = draw_case(23, ("stiffness",), "strong", "joint", round_s=6.0, lowpass_hz=3.0)
    write_log(case.logs[0], tmp_path / "finger.csv")
    for out in ("one", "two"):
        words = ["sysid", "diagnose", str(tmp_path / "finger.csv")]
        assert main([*words, "-o", str(tmp_path / out)]) == 0
    assert "stiffness" in capsys.readouterr().out
    # What is compiled for a record the next diagnosis of it need not compile.
    assert jax.config.jax_compilation_cache_dir == cache  # pyright: ignore
    said, again = (
        json.loads((tmp_path / out / "diagnosis.json").read_text())
        for out in ("one", "two")
    )
    keys = ("verdict", "causes", "alternatives", "gain", "next_experiment")
    for key in (*keys, "log_sha256", "seed"):
        assert said[key] == again[key]
    assert said["runtime_s"] > 0.0
    cause = said["causes"][0]
    assert cause["effect"] == "stiffness"
    assert cause["where"] == case.joint
    assert set(cause["parameters"]["scale"]) == {"value", "low", "high", "unit"}
    hand = load_hand_file(tmp_path / "one" / "hand.yaml")
    assert hand.stiffness_scale != load_hand_file().stiffness_scale
    assert said["log_sha256"][0] in hand.stiffness_scale.source
    page = (tmp_path / "one" / "report.html").read_text()
    assert "stiffness" in page
    outside = r"(?:src|href)\s*=\s*[\"']?(?:https?:|//|file:)|@import"
    assert re.findall(outside, page) == []  # all pictures are in the page
    assert page.count("<img") + page.count("<svg") >= 3
