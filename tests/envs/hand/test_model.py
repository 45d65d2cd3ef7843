import json
from pathlib import Path

import jax.numpy as jnp
import mujoco
import numpy as np
import pytest

from envs.config.typed import override
from envs.hand import nominal
from envs.hand.hand_file import load_hand_file
from envs.hand.model import FLOOR, PALM, PAYLOAD, build_model, build_spec
from envs.hand.nominal import FINGERS, vendor_hand
from envs.hand.spec import hand_spec
from envs.hand.stance import load_stance

HAND = load_hand_file()
MODEL = build_model(HAND)
SPEC = hand_spec(MODEL)
VENDOR = json.loads(Path(nominal.__file__).with_name("vendor_hand.json").read_text())
CHECKS = tuple(
    (np.array(check["qpos"]), np.array(check["fingertip_in_palm"]))
    for check in VENDOR["forward_kinematics_checks"]
)


def tips_in_palm(qpos):
    """Forward kinematics, with the palm put somewhere askew."""
    data = mujoco.MjData(MODEL)
    data.qpos[:] = [0.3, -0.2, 0.5, 0.5, -0.1, 0.7, 0.5, *qpos]
    data.qpos[3:7] /= np.linalg.norm(data.qpos[3:7])
    mujoco.mj_kinematics(MODEL, data)
    palm = data.body(PALM)
    tips = np.array([data.site(name).xpos for name in SPEC.tip_sites])
    return (tips - palm.xpos) @ palm.xmat.reshape(3, 3)


@pytest.mark.parametrize("pose", range(5))
def test_forward_kinematics_at_the_check_poses(pose):
    """The vendor's kinematics, to a micrometre."""
    qpos, tips = CHECKS[pose]
    np.testing.assert_allclose(tips_in_palm(qpos), tips, rtol=0, atol=1e-6)


@pytest.mark.parametrize("joint", range(20))
def test_the_check_poses_notice_each_joint(joint):
    """Negative control: a tenth of a degree in any joint moves a tip by more."""
    wrong = []
    for qpos, tips in CHECKS:
        moved = qpos.copy()
        moved[joint] += np.deg2rad(0.1)
        wrong.append(np.abs(tips_in_palm(moved) - tips).max())
    assert max(wrong) > 1e-5


def test_mass_is_that_of_the_weighed_hand_with_its_module():
    assert MODEL.body_subtreemass[1] == pytest.approx(0.818, abs=1e-9)
    assert MODEL.body(PAYLOAD).mass[0] == pytest.approx(0.080)


def test_every_body_could_exist():
    """Principal inertias are positive and obey the triangle inequality."""
    inertia = np.sort(MODEL.body_inertia[1:], axis=1)
    assert (inertia > 0).all()
    assert (inertia[:, 2] <= inertia[:, 0] + inertia[:, 1] + 1e-12).all()


def test_joints_and_drives_are_those_of_the_vendor_and_the_hand_file():
    vendor = vendor_hand()
    joints = vendor.joint_names
    assert [MODEL.joint(i).name for i in range(1, 21)] == list(joints)
    assert [MODEL.actuator(i).name for i in range(20)] == list(joints)
    np.testing.assert_allclose(MODEL.jnt_range[1:], vendor.per_joint("range_rad"))
    kp, kv, limit = (vendor_hand().per_joint(k) for k in ("kp", "kv", "force_limit"))
    np.testing.assert_allclose(MODEL.actuator_gainprm[:, 0], 18.7 * kp)
    np.testing.assert_allclose(MODEL.actuator_biasprm[:, 1], -18.7 * kp)
    np.testing.assert_allclose(MODEL.actuator_biasprm[:, 2], -np.sqrt(18.7) * kv)
    np.testing.assert_allclose(MODEL.actuator_forcerange[:, 1], limit)
    np.testing.assert_array_equal(
        MODEL.actuator_forcerange[:, 0], -MODEL.actuator_forcerange[:, 1]
    )


def test_the_hand_file_reaches_the_model():
    assignments = ["payload_mass.value=0.1", "tip_friction.value=0.9"]
    assignments += ["link_friction.value=0.4", "payload_pos.value.2=0.05"]
    other = build_model(override(HAND, assignments))
    assert other.body_subtreemass[1] == pytest.approx(0.838)
    assert other.body(PAYLOAD).pos[2] == 0.05
    friction = {
        MODEL.geom(g).name: other.geom_friction[g, 0] for g in range(other.ngeom)
    }
    assert {friction[name] for name in SPEC.tip_links + SPEC.tip_spheres} == {0.9}
    assert {friction[name] for name in (*SPEC.other_links, PALM, PAYLOAD)} == {0.4}


def test_geometry_is_primitive_and_a_tip_is_the_end_of_its_capsule():
    kinds = mujoco.mjtGeom
    assert MODEL.nmesh == 0
    for link, sphere in zip(SPEC.tip_links, SPEC.tip_spheres, strict=True):
        capsule, tip = MODEL.geom(link), MODEL.geom(sphere)
        assert capsule.type[0] == kinds.mjGEOM_CAPSULE
        assert tip.type[0] == kinds.mjGEOM_SPHERE
        axis = np.zeros(9)
        mujoco.mju_quat2Mat(axis, capsule.quat)
        half = axis.reshape(3, 3)[:, 2] * capsule.size[1]
        ends = capsule.pos + np.array([half, -half])
        assert np.linalg.norm(ends - tip.pos, axis=1).min() < 1e-9
        assert tip.size[0] == capsule.size[0]
    sites = [MODEL.site(name).pos for name in SPEC.tip_sites]
    np.testing.assert_allclose(sites, [MODEL.geom(s).pos for s in SPEC.tip_spheres])


def collide(one, other):
    a, b = MODEL.geom(one), MODEL.geom(other)
    bits = (a.contype & b.conaffinity) | (b.contype & a.conaffinity)
    return bool(bits[0])


def test_what_may_touch_what():
    """A tip meets the floor with its sphere and the rest of the hand as a capsule."""
    links = (*SPEC.other_links, PALM, PAYLOAD)
    assert all(collide(name, FLOOR) for name in (*links, *SPEC.tip_spheres))
    assert not any(collide(name, FLOOR) for name in SPEC.tip_links)
    capsules = (*SPEC.tip_links, *links)
    assert all(collide(a, b) for a in capsules for b in capsules)
    assert not any(
        collide(a, b) for a in SPEC.tip_spheres for b in (*capsules, *SPEC.tip_spheres)
    )


def test_nothing_touches_itself_in_the_stance():
    data = mujoco.MjData(MODEL)
    data.qpos[:] = load_stance().qpos
    data.qpos[2] += 0.1
    mujoco.mj_forward(MODEL, data)
    assert data.ncon == 0


def test_fingers_can_touch_each_other():
    """Self-collision is on: the fully flexed index meets the thumb or the palm."""
    data = mujoco.MjData(MODEL)
    found = set()
    rng = np.random.default_rng(20260115)
    low, high = vendor_hand().per_joint("range_rad").T
    for _ in range(50):
        data.qpos[:] = [0, 0, 1, 1, 0, 0, 0, *rng.uniform(low, high)]
        mujoco.mj_forward(MODEL, data)
        found |= {frozenset(c.geom.tolist()) for c in data.contact[: data.ncon]}
    names = {frozenset(MODEL.geom(g).name for g in pair) for pair in found}
    assert any(len({name[:7] for name in pair}) == 2 for pair in names)
    neighbours = [
        {PALM, f"finger{finger}_link2"} for finger in range(1, len(FINGERS) + 1)
    ]
    assert not any(pair in names for pair in map(frozenset, neighbours))


def test_sensors_are_found_by_name():
    spec = hand_spec(MODEL)
    assert sum(s.stop - s.start for s in spec.sensors.values()) == MODEL.nsensordata
    vector = jnp.arange(float(MODEL.nsensordata))
    torque = [spec.read(vector, f"torque_{name}") for name in vendor_hand().joint_names]
    assert all(len(x) == 1 for x in torque)
    assert len({int(x[0]) for x in torque}) == 20
    with pytest.raises(KeyError):
        spec.read(vector, "torque_finger6_joint1")


def test_the_model_survives_as_mjcf(tmp_path):
    """What is written as XML compiles to the same hand."""
    spec = build_spec(HAND)
    spec.compile()
    again = mujoco.MjModel.from_xml_string(spec.to_xml())
    for name in ("body_mass", "body_inertia", "jnt_range", "actuator_gainprm"):
        np.testing.assert_allclose(
            getattr(again, name), getattr(MODEL, name), rtol=1e-4, err_msg=name
        )
    assert (again.nq, again.nu, again.nsensordata) == (27, 20, MODEL.nsensordata)
