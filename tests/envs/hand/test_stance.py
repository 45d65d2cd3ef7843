import dataclasses

import mujoco
import numpy as np
import pytest

from envs.config.typed import override
from envs.errors import InputError
from envs.hand import stance as stance_module
from envs.hand.hand_file import load_hand_file
from envs.hand.model import FLOOR, PALM, build_model
from envs.hand.nominal import FINGERS
from envs.hand.spec import hand_spec
from envs.hand.stance import load_stance, settle, stance_json, stance_of
from envs.hand.support import support_margins

HAND = load_hand_file()
STANCE = load_stance()
TARGET = np.array(STANCE.target_rad)
MODEL = build_model(HAND, np.array(STANCE.q_off))
SPEC = hand_spec(MODEL)


@pytest.fixture(scope="module")
def standing():
    """The stored stance, held for another second."""
    data = mujoco.MjData(MODEL)
    data.qpos[:], data.ctrl[:] = STANCE.qpos, TARGET
    mujoco.mj_step(MODEL, data, 200)
    return data


def test_it_belongs_to_the_default_hand_file():
    """If this fails, the hand file was changed: run `fingers hand stance`."""
    assert STANCE.hand_sha256 == HAND.sha256


def test_it_stands_still(standing):
    np.testing.assert_allclose(standing.qpos, STANCE.qpos, atol=2e-5)
    assert np.abs(standing.qvel).max() < 1e-3


def test_five_tips_and_nothing_else_are_down(standing):
    floor = MODEL.geom(FLOOR).id
    touching = set()
    for index in range(standing.ncon):
        pair = set(standing.contact[index].geom.tolist())
        assert floor in pair
        touching |= pair - {floor}
    assert {MODEL.geom(g).name for g in touching} == set(SPEC.tip_spheres)
    for link in SPEC.tip_spheres:
        slot = MODEL.sensor(f"force_{link}")
        force = standing.sensordata[slot.adr[0] :][: slot.dim[0]]
        assert np.linalg.norm(force) > 0.15, link


def test_v_is_level_and_points_from_the_palm_to_the_distal_links(standing):
    """Paper: forward is horizontal, to the centroid of the index-little links."""
    axes = standing.site("control_frame").xmat.reshape(3, 3)
    np.testing.assert_allclose(axes[:, 2], [0, 0, 1], atol=1e-4)
    links = [standing.body(f"finger{n}_link4").xpos for n in (2, 3, 4, 5)]
    forward = np.mean(links, axis=0) - standing.body(PALM).xpos
    forward[2] = 0
    np.testing.assert_allclose(axes[:, 0], forward / np.linalg.norm(forward), atol=1e-4)


def test_nominal_footprint_is_where_the_tips_are(standing):
    axes = standing.site("control_frame").xmat.reshape(3, 3)
    tips = np.array([standing.site(name).xpos for name in SPEC.tip_sites])
    in_v = (tips - standing.body(PALM).xpos) @ axes
    np.testing.assert_allclose(STANCE.footprint_v, in_v, atol=5e-5)
    # The four fingers stand side by side, from the index to the little finger.
    order = list(in_v[FINGERS.index("index") :, 1])
    assert order == sorted(order) or order == sorted(order, reverse=True)


def test_the_centre_of_mass_is_well_inside_the_footprint(standing):
    tips = np.array([standing.site(name).xpos[:2] for name in SPEC.tip_sites])
    margin = support_margins(standing.subtree_com[1][:2], tips).min()
    assert margin > 0.025
    outside = support_margins(tips.mean(axis=0) + np.array([0.2, 0]), tips).min()
    assert outside < 0


def test_settling_gives_the_stored_stance_again():
    again = settle(HAND, STANCE.qpos, TARGET)
    for name, value in dataclasses.asdict(STANCE).items():
        if name != "hand_sha256":
            np.testing.assert_allclose(
                getattr(again, name), value, atol=2e-5, err_msg=name
            )


def test_file_and_stance_are_the_same_thing():
    path = stance_module.files("envs.hand").joinpath("stance.json")
    assert path.read_text("utf-8") == stance_json(STANCE)


def test_another_hand_gets_a_stance_of_its_own():
    assert stance_of(HAND) is STANCE
    heavy = override(HAND, ["payload_mass.value=0.3"])
    stance = stance_of(heavy)
    assert stance.hand_sha256 == heavy.sha256
    assert stance.target_rad == STANCE.target_rad
    assert stance.root_pos_w[2] < STANCE.root_pos_w[2] - 1e-4


def test_a_hand_that_cannot_stand_is_named():
    weak = ["stiffness_scale.low=null", "stiffness_scale.value=0.5"]
    with pytest.raises(InputError, match="stance: target_rad: found speed"):
        stance_of(override(HAND, weak))
    with pytest.raises(InputError, match="palm at"):
        settle(HAND, STANCE.qpos, np.zeros(20))
