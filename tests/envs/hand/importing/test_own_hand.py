"""A hand built otherwise than the vendor's: its frames, gains, and what is refused."""

from pathlib import Path

import mujoco
import numpy as np
import pytest

from envs.config.typed import from_dict, load_yaml
from envs.errors import InputError
from envs.hand.importing.check import TIP_ERROR_M, tip_error_m
from envs.hand.importing.convert import import_hand
from envs.hand.importing.joint_map import JointMap
from envs.hand.importing.load import load_custom_hand
from envs.hand.importing.own_frames import Hinges, own_link_frames, own_palm_frame
from envs.hand.importing.palm import Frame
from envs.hand.importing.place import place
from envs.hand.model import build_model
from envs.hand.stance import stance_of
from envs.hand.stance_search import with_stance

EXAMPLE = Path(__file__).parents[4] / "examples/second_hand"
MJCF = EXAMPLE / "small_hand.xml"
MAP = load_yaml(JointMap, EXAMPLE / "small_map.yaml")
FINGERS = {name: list(joints) for name, joints in MAP.fingers.items()}


@pytest.fixture(scope="module")
def hand():
    return import_hand(MJCF, MAP).hand


def changed(tmp_path, *changes):
    text = MJCF.read_text("utf-8")
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = tmp_path / "hand.xml"
    path.write_text(text, "utf-8")
    return path


def test_sizes_masses_and_gains_are_the_models(hand):
    nominal = hand.nominal
    assert nominal.fingers == ("thumb", "index", "middle", "ring")
    assert (nominal.links_per_finger, len(nominal.links)) == (3, 12)
    theirs = mujoco.MjModel.from_xml_path(str(MJCF))
    assert build_model(hand).body_mass.sum() == pytest.approx(theirs.body_mass.sum())
    np.testing.assert_allclose(nominal.per_joint("kp"), 4.0)
    np.testing.assert_allclose(nominal.per_joint("kv"), 0.08 + 0.02)
    np.testing.assert_allclose(nominal.per_joint("force_limit"), 0.8)
    np.testing.assert_array_equal(hand.per_joint("speed_limit"), np.full(12, 4.0))
    assert [link.capsule is None for link in nominal.links] == [True, False, False] * 4


def test_both_models_move_their_fingertips_alike(hand):
    placed = place(load_custom_hand(MJCF, MAP), like_vendor=False)
    assert tip_error_m(placed, hand) < TIP_ERROR_M


def test_the_palm_frame_is_along_fingers_and_pads():
    """Fingers along +x and pads at -z of the file are +z and +x of ours."""
    palm = place(load_custom_hand(MJCF, MAP), like_vendor=False).palm
    np.testing.assert_allclose(palm.mat[:, 2], [1.0, 0.0, 0.0], atol=1e-9)
    np.testing.assert_allclose(palm.mat[:, 0], [0.0, 0.0, -1.0], atol=1e-9)


def hinges(**changes):
    """Three fingers of two joints along x, which bend about y."""
    anchors = np.array([[0.04 * i, 0.03 * f, 0.0] for f in range(3) for i in range(2)])
    given = {
        "path": MJCF,
        "names": tuple("abcdef"),
        "anchors": anchors,
        "axes": np.tile([0.0, 1.0, 0.0], (6, 1)),
        "tips": anchors[1::2] + np.array([0.03, 0.0, 0.0]),
        "ranges": np.tile([-0.2, 1.5], (6, 1)),
    }
    return Hinges(**(given | changes))


def test_where_a_hinge_lies_along_itself_does_not_count():
    slid = hinges().anchors + np.outer([0.0, 0.01, 0.02, -0.01, 0.0, 0.015], [0, 1, 0])
    ours, theirs = (own_palm_frame(h) for h in (hinges(), hinges(anchors=slid)))
    np.testing.assert_allclose(ours.mat, theirs.mat, atol=1e-12)
    other = hinges(anchors=hinges().anchors + np.outer(np.arange(6), [0, 0, 0.004]))
    assert np.abs(own_palm_frame(other).mat - ours.mat).max() > 0.01  # negative control


def test_a_fingertip_goes_to_its_pad_where_it_flexes():
    palm = own_palm_frame(hinges())
    for frame in own_link_frames(hinges().moved_into(palm)):
        np.testing.assert_allclose(frame.mat @ frame.mat.T, np.eye(3), atol=1e-12)
        np.testing.assert_allclose(frame.mat[:, 0], [1.0, 0.0, 0.0], atol=1e-12)


def test_a_first_hinge_along_its_lever_takes_the_palms_side():
    """A finger that turns about its own length."""
    axes = hinges().axes.copy()
    axes[::2] = [1.0, 0.0, 0.0]
    twisted = hinges(axes=axes)
    frames = own_link_frames(twisted.moved_into(own_palm_frame(twisted)))
    np.testing.assert_allclose(frames[0].mat[:, 1], [0.0, 0.0, 1.0], atol=1e-12)
    np.testing.assert_allclose(frames[0].mat[:, 0], [1.0, 0.0, 0.0], atol=1e-12)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"ranges": np.tile([-1.5, 0.2], (6, 1))}, "positive angles that flex"),
        ({"axes": np.tile([1.0, 0.0, 0.0], (6, 1))}, "moves its fingertip, not b"),
    ],
)
def test_pads_that_are_not_clear_are_refused(changes, words):
    with pytest.raises(InputError, match=words):
        own_link_frames(hinges(**changes))


def test_pads_that_look_to_no_common_side_ask_for_the_frame():
    axes = hinges().axes * np.repeat([1.0, 1.0, -1.0], 2)[:, None]
    with pytest.raises(InputError, match="a palm_quat"):
        own_palm_frame(hinges(axes=axes))
    given = own_palm_frame(hinges(axes=axes), (1.0, 0.0, 0.0, 0.0))
    assert isinstance(given, Frame) and np.array_equal(given.mat, np.eye(3))


@pytest.mark.parametrize(
    ("data", "words"),
    [
        ({"fingers": {"thumb": ["a", "b"]}}, "3 to 5 fingers"),
        ({"fingers": FINGERS | {"toe": ["a", "b", "c"]}}, "first of thumb"),
        ({"fingers": FINGERS | {"ring": ["a", "b"]}}, "equally many"),
        ({"fingers": FINGERS, "joints": {"finger1_joint1": "a"}}, "fingers names all"),
        ({"drive": {"kp": 1.0}}, "fingers too"),
        ({"fingers": FINGERS, "drive": {"kp": -1.0}}, "drive.kp"),
    ],
)
def test_a_map_with_mistakes_is_refused(data, words):
    with pytest.raises(InputError, match=words):
        from_dict(JointMap, data, "map.yaml")


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ([(' forcerange="-0.8 0.8"', "")], r"no torque limits .*force_limit: …"),
        ([("<position name", "<motor name")], "no kp of position servos"),
        ([('name="ring_3" class', 'name="last" class')], "ring_3"),
        ([('type="box"', 'type="box" contype="0" conaffinity="0"')], "on the palm"),
    ],
)
def test_what_the_model_lacks_is_named(tmp_path, changes, words):
    with pytest.raises(InputError, match=words):
        import_hand(changed(tmp_path, *changes), MAP)


def test_what_lacks_may_be_given(tmp_path):
    path = changed(tmp_path, (' forcerange="-0.8 0.8"', ""))
    drive = {"drive": {"force_limit": 0.5, "armature": 0.002}}
    given = from_dict(JointMap, {"fingers": FINGERS} | drive, "map.yaml")
    hand = import_hand(path, given).hand
    np.testing.assert_allclose(hand.nominal.per_joint("force_limit"), 0.5)
    np.testing.assert_allclose(hand.nominal.per_joint("armature"), 0.002)
    assert hand.torque_scale.note == "force_limit is that of the map"
    assert "lowest of the default" in hand.speed_limit.note


def test_three_fingers_stand_too(tmp_path):
    spec = mujoco.MjSpec.from_file(str(MJCF))
    for actuator in [a for a in spec.actuators if a.name.startswith("ring")]:
        spec.delete(actuator)
    spec.delete(spec.body("ring_base"))
    spec.compile()
    path = tmp_path / "hand.xml"
    path.write_text(spec.to_xml(), "utf-8")
    fingers = {name: joints for name, joints in FINGERS.items() if name != "ring"}
    hand = import_hand(path, from_dict(JointMap, {"fingers": fingers}, "map.yaml")).hand
    stance = stance_of(with_stance(hand, starts=2))
    assert (len(stance.target_rad), len(stance.footprint_v)) == (9, 3)
    assert stance.root_pos_w[2] > 0.05
