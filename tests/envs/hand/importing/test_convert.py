"""A user's MJCF becomes a hand file that is the same hand."""

import dataclasses
import struct

import mujoco
import numpy as np
import pytest

from envs.errors import InputError
from envs.hand.hand_file import hand_yaml, load_hand_file
from envs.hand.importing.check import TIP_ERROR_M, check_same, tip_error_m
from envs.hand.importing.convert import import_hand
from envs.hand.importing.joint_map import JointMap
from envs.hand.importing.load import load_custom_hand
from envs.hand.importing.palm import Frame, rotation
from envs.hand.importing.place import place
from envs.hand.model import PALM, PAYLOAD, build_model, build_spec
from envs.hand.nominal import vendor_hand
from envs.hand.quantity import JointQuantity
from envs.hand.stance import load_stance, stance_of
from envs.registry import make_env

HAND = load_hand_file()
MODEL = build_model(HAND)
JOINTS = vendor_hand().joint_names
THEIRS = {name: f"right_{name.replace('finger', 'digit')}" for name in JOINTS}
TURNED = (0.5, 0.5, -0.5, 0.5)


@pytest.fixture(scope="module")
def ours(tmp_path_factory):
    """Our own hand as an MJCF file."""
    path = tmp_path_factory.mktemp("ours") / "hand.xml"
    return written(path, build_spec(HAND))


@pytest.fixture(scope="module")
def vendor(tmp_path_factory):
    """The same hand with other names, other frames, and meshes for capsules."""
    path = tmp_path_factory.mktemp("vendor") / "hand.xml"
    (path.parent / "box.stl").write_bytes(cube())
    spec = build_spec(HAND)
    spec.assets = {"box.stl": cube()}
    reframe(spec, np.random.default_rng(3))
    with_meshes(spec)
    rename(spec)
    return written(path, spec)


def written(path, spec):
    spec.compile()
    path.write_text(spec.to_xml())
    return path


def cube() -> bytes:
    """A binary STL of the cube from -1 to 1."""
    faces = []
    for axis in range(3):
        for sign in (-1.0, 1.0):
            corners = []
            for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
                corner = np.roll([sign, a, b], axis)
                corners.append(corner)
            order = (0, 1, 2, 3) if sign > 0 else (3, 2, 1, 0)
            first, second, third, fourth = (corners[i] for i in order)
            faces += [(first, second, third), (first, third, fourth)]
    body = b"".join(struct.pack("<12fH", 0, 0, 0, *np.ravel(face), 0) for face in faces)
    return b" " * 80 + struct.pack("<I", len(faces)) + body


def reframe(spec, rng) -> None:
    """Turns and shifts the frame of every link, and turns that of the palm."""
    moved = {}
    for body in spec.bodies[1:]:
        pos = np.zeros(3) if body.name == PALM else rng.normal(0, 0.01, 3)
        quat = rng.normal(size=4)
        moved[body.name] = Frame(pos, rotation(quat / np.linalg.norm(quat)))
    for body in spec.bodies[1:]:
        new = moved[body.name]
        frame = Frame(np.array(body.pos), rotation(body.quat)).of(new)
        if body.name != PALM:
            frame = moved[body.parent.name].inverse.of(frame)
        body.pos, body.quat = frame.pos, frame.quat
        inner = new.inverse
        inertial = inner.of(Frame(np.array(body.ipos), rotation(body.iquat)))
        body.ipos, body.iquat = inertial.pos, inertial.quat
        for joint in body.joints:
            if joint.type == mujoco.mjtJoint.mjJNT_HINGE:
                joint.pos, joint.axis = inner.pos, inner.mat @ joint.axis
        for geom in body.geoms:
            placed = inner.of(at(geom))
            geom.fromto = np.full(6, np.nan)
            geom.pos, geom.quat = placed.pos, placed.quat
        for site in body.sites:
            spec.delete(site)


def at(geom) -> Frame:
    """Pose of a geom in its body; our capsules lie along z."""
    if geom.type == mujoco.mjtGeom.mjGEOM_CAPSULE and np.isfinite(geom.fromto[0]):
        ends = np.reshape(geom.fromto, (2, 3))
        geom.size = [geom.size[0], np.linalg.norm(ends[1] - ends[0]) / 2, 0]
        return Frame(ends.mean(axis=0), np.eye(3))
    return Frame(np.array(geom.pos), rotation(geom.quat))


def with_meshes(spec) -> None:
    """Puts boxes of the same bounds, as meshes, in the place of capsules."""
    for body in spec.bodies[1:]:
        for geom in body.geoms:
            if geom.type == mujoco.mjtGeom.mjGEOM_CAPSULE:
                radius, half = geom.size[:2]
                mesh = spec.add_mesh(name=f"mesh_{geom.name}", file="box.stl")
                mesh.scale = [radius, radius, half + radius]
                geom.type, geom.meshname = mujoco.mjtGeom.mjGEOM_MESH, mesh.name
                geom.contype, geom.conaffinity = 1, 1
            elif geom.name.endswith("_tip"):
                spec.delete(geom)


def rename(spec) -> None:
    """Gives names of their own, and leaves out what refers to ours."""
    for group in (spec.sensors, spec.excludes):
        for item in list(group):
            spec.delete(item)
    for actuator in spec.actuators:
        actuator.target = THEIRS[actuator.target]
    for joint in spec.joints:
        joint.name = THEIRS.get(joint.name, joint.name)
    for body in spec.bodies[1:]:
        body.name = body.name.replace("finger", "digit")


def tensors(model):
    """Inertia of all bodies in their own frames."""
    mats = [rotation(quat) for quat in model.body_iquat]
    return [m @ np.diag(d) @ m.T for m, d in zip(mats, model.body_inertia, strict=True)]


def assert_same(model, wanted):
    """The two hands fall, turn, push and touch alike."""
    for name in ("body_pos", "body_ipos", "jnt_range", "geom_size", "geom_pos"):
        mine, theirs = getattr(model, name), getattr(wanted, name)
        np.testing.assert_allclose(mine, theirs, atol=2e-6, err_msg=name)
    turns = np.abs(np.sum(model.body_quat * wanted.body_quat, axis=1))
    np.testing.assert_allclose(turns, 1.0, atol=1e-9)
    for name in ("body_mass", "dof_armature", "actuator_forcerange"):
        mine, theirs = getattr(model, name), getattr(wanted, name)
        np.testing.assert_allclose(mine, theirs, rtol=1e-5, err_msg=name)
    for name in ("actuator_gainprm", "actuator_biasprm"):
        mine, theirs = getattr(model, name), getattr(wanted, name)
        np.testing.assert_allclose(mine, theirs, rtol=2e-5, err_msg=name)
    np.testing.assert_allclose(tensors(model), tensors(wanted), rtol=1e-4, atol=1e-10)


def test_our_own_hand_comes_back(ours):
    found = import_hand(ours)
    assert_same(build_model(found.hand), MODEL)
    settled = stance_of(found.hand)
    assert settled.hand_sha256 != HAND.sha256
    np.testing.assert_allclose(settled.qpos, load_stance().qpos, atol=1e-5)
    limits = "torque_scale: the default hand's, on the vendor's parameters"
    assert found.notes == (limits,)


def test_other_names_frames_and_meshes_are_the_same_hand(vendor):
    found = import_hand(vendor, JointMap(THEIRS))
    assert_same(build_model(found.hand), MODEL)
    np.testing.assert_allclose(
        stance_of(found.hand).qpos, load_stance().qpos, atol=1e-4
    )
    assert mujoco.MjModel.from_xml_path(str(vendor)).nmesh == 15  # nothing else


def test_the_vendors_nominal_gains_are_scaled_as_ours_are(tmp_path):
    one = JointQuantity(1.0, "1", "user")
    nominal = dataclasses.replace(HAND, stiffness_scale=one, damping_scale=one)
    found = import_hand(written(tmp_path / "hand.xml", build_spec(nominal)))
    assert found.hand.stiffness_scale == HAND.stiffness_scale
    assert_same(build_model(found.hand), MODEL)


def test_a_shifted_link_and_a_lost_gram_are_seen(vendor):
    """Negative control of the comparison at the end of every import."""
    hand = import_hand(vendor, JointMap(THEIRS)).hand
    placed = place(load_custom_hand(vendor, JointMap(THEIRS)))
    assert tip_error_m(placed, hand) < TIP_ERROR_M
    check_same(placed, hand)
    for index in range(20):
        x, y, z = hand.nominal.links[index].pos
        shifted = with_link(hand, index, pos=(x, y, z + 1e-5))
        assert tip_error_m(placed, shifted) > TIP_ERROR_M, JOINTS[index]
    with pytest.raises(InputError, match=r"fingertips 0\.009\d* mm apart"):
        check_same(placed, shifted)
    heavier = with_link(hand, 5, mass=hand.nominal.links[5].mass + 1e-3)
    with pytest.raises(InputError, match=r"0\.818 kg in the model, 0\.819 kg carried"):
        check_same(placed, heavier)


def with_link(hand, index, **changes):
    links = list(hand.nominal.links)
    links[index] = dataclasses.replace(links[index], **changes)
    own = dataclasses.replace(hand.nominal, links=tuple(links))
    return dataclasses.replace(hand, description=own)


def test_the_frame_of_the_palm_may_be_given(tmp_path):
    """A thumb 80 mm off: the finger bases fit in no frame, so it is asked for."""
    spec = build_spec(HAND)
    turn = rotation(np.array(TURNED)).T
    for body in spec.body(PALM).bodies:
        far = [0.0, 0.08, 0.0] if body.name == "finger1_link1" else np.zeros(3)
        placed = Frame(np.zeros(3), turn).of(
            Frame(np.add(body.pos, far), rotation(body.quat))
        )
        body.pos, body.quat = placed.pos, placed.quat
    path = written(tmp_path / "hand.xml", spec)
    with pytest.raises(InputError, match=r"palm_quat: found finger bases .* mm from"):
        import_hand(path)
    quat = tuple(np.array(TURNED) * [1, -1, -1, -1])
    links = import_hand(path, JointMap(palm_quat=quat)).hand.nominal.links
    wanted = np.array([link.pos for link in vendor_hand().links[::4]])
    wanted[0, 1] += 0.08
    np.testing.assert_allclose([k.pos for k in links[::4]], wanted, atol=1e-6)


def test_what_the_model_lacks_is_the_vendors_and_noted(tmp_path):
    spec = build_spec(HAND)
    for group in (spec.sensors, spec.excludes, spec.actuators):
        for item in list(group):
            spec.delete(item)
    for joint in spec.joints:
        joint.armature = 0.0
    for geom in list(spec.body("finger4_link3").geoms):
        spec.delete(geom)
    spec.body(PAYLOAD).name = "pack"
    spec.delete(spec.joint("root"))
    tied = spec.add_equality(name1=JOINTS[6], name2=JOINTS[7])
    tied.type, tied.objtype = mujoco.mjtEq.mjEQ_JOINT, mujoco.mjtObj.mjOBJ_JOINT
    bare = written(tmp_path / "hand.xml", spec)
    found = import_hand(bare)
    notes = " ".join(found.notes)
    named = ["servos", "kv", "torque limits", "armature", "payload", "palm is fixed"]
    named += ["equality constraints", "on finger4_link3"]
    assert [what for what in named if what not in notes] == []
    nominal = found.hand.nominal
    for name in ("kp", "kv", "force_limit", "armature"):
        wanted = vendor_hand().per_joint(name)
        np.testing.assert_allclose(nominal.per_joint(name), wanted, rtol=1e-9)
    assert nominal.links[14].capsule == vendor_hand().links[14].capsule
    assert found.hand.stiffness_scale == HAND.stiffness_scale
    assert found.hand.payload_mass.value == 0.0
    assert found.hand.palm_mass.value == pytest.approx(0.38908 + 0.080, abs=1e-9)


def test_hinges_that_turn_the_other_way_are_named(ours, tmp_path):
    text = ours.read_text()
    at = text.index('name="finger3_joint3"')
    turned = text[:at] + text[at:].replace('axis="0 1 0"', 'axis="0 -1 0"', 1)
    (tmp_path / "hand.xml").write_text(turned)
    with pytest.raises(InputError, match=r"turned: finger3_joint3 \(180°\); valid"):
        import_hand(tmp_path / "hand.xml")


def test_the_environment_runs_the_imported_hand(ours):
    hand = with_link(import_hand(ours).hand, 7, kp=0.5, range_rad=(-0.1, 1.2))
    env = make_env("crawl", hand=hand)
    assert env.mj_model.jnt_range[8] == pytest.approx([-0.1, 1.2])
    assert env.mj_model.actuator_gainprm[7, 0] == pytest.approx(0.5)


def test_a_flat_link_keeps_moments_that_a_body_can_have(tmp_path):
    spec = build_spec(HAND)
    for body in (link.body for link in vendor_hand().links):
        spec.body(body).inertia = [1e-6, 1e-6, 2e-6]
    hand = import_hand(written(tmp_path / "hand.xml", spec)).hand
    found = np.sort(build_model(hand).body_inertia[3:], axis=1)
    np.testing.assert_allclose(found[:, :2].sum(axis=1), found[:, 2], rtol=1e-8)


def test_the_keyboard_task_refuses_it():
    """Its fingertip is computed from the vendor's dimensions, here and on the robot."""
    own = dataclasses.replace(HAND, description=vendor_hand())
    with pytest.raises(InputError, match="hand file: description"):
        make_env("keyboard", hand=own)


FIELDS = [
    ("quat: [0.68", "quat: [0.98", "description.links.0.quat: found"),
    (
        "body: finger1_link2",
        "body: finger1_linq2",
        "description.links: found finger1_linq2",
    ),
    (
        "mass: 0.0248",
        "mass: -1.0",
        r"description.links.1.mass: found -1.0; valid: .* >=",
    ),
    ("joint: finger5_joint4", "join: x", "description.links.19.join: found join"),
    ("bounds_max: [0.0141", "bounds_max: [-0.4", "description.palm.bounds_max: found"),
    ("armature: 0.0005", "armature: .nan", "description.links.0.armature: found"),
    ("tip: [-0.00105", "tap: [-0.00105", "description.links.3.tap: found tap"),
    (
        "diaginertia: [3.37599e-07",
        "diaginertia: [6.0e-07",
        "links.0.diaginertia: found",
    ),
    ("range_rad: [0.0475", "range_rad: [2.0", "description.links.0.range_rad: found"),
]


@pytest.mark.parametrize(("old", "new", "message"), FIELDS)
def test_malformed_descriptions_are_named(tmp_path, old, new, message):
    own = dataclasses.replace(HAND, description=vendor_hand())
    text = hand_yaml(own)
    assert old in text
    path = tmp_path / "hand.yaml"
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(InputError, match=message):
        load_hand_file(path)


def test_a_description_survives_the_hand_file_and_counts_in_its_digest(tmp_path):
    own = dataclasses.replace(HAND, description=vendor_hand())
    path = tmp_path / "hand.yaml"
    path.write_text(hand_yaml(own), encoding="utf-8")
    assert load_hand_file(path) == own
    other = with_link(own, 0, kp=0.41)
    assert len({HAND.sha256, own.sha256, other.sha256}) == 3
