import os
import random
import struct
import time
from pathlib import Path

import numpy as np
import pytest

from envs.errors import InputError
from envs.hand.importing.joint_map import JointMap
from envs.hand.importing.load import load_custom_hand
from envs.hand.nominal import vendor_hand

SEED = 20260104
JOINTS = vendor_hand().joint_names
HINGE = '<joint name="{joint}" axis="0 1 0" range="0 90"/>'
BASE = '<body name="base"><freejoint name="root"/><geom size="0.02" mass="0.3"/>'
ACTUATOR = '<position name="act_{0}" joint="{0}" kp="1"/>'
CAPSULE = '<geom type="capsule" size="0.005" fromto="0 0 0 0 0 0.02" mass="0.01"/>'


def hand_xml(joint: str = HINGE, tip: str = CAPSULE, prefix: str = "") -> str:
    """A hand of 20 hinges with their actuators, little finger first."""
    fingers = actuators = ""
    for finger in (5, 4, 3, 2, 1):
        opened = ""
        for link in (1, 2, 3, 4):
            name = f"{prefix}finger{finger}_joint{link}"
            geom = tip if link == 4 else CAPSULE
            opened += f'<body name="{prefix}f{finger}l{link}" pos="0 0 0.02">'
            opened += joint.format(joint=name) + geom
            actuators += ACTUATOR.format(name)
        fingers += opened + "</body>" * 4
    return (
        '<mujoco model="m"><option timestep="0.005"/><worldbody>'
        f"{BASE}{fingers}</body></worldbody><actuator>{actuators}</actuator></mujoco>"
    )


GOOD = hand_xml()


def write(folder: Path, text: str | bytes, name: str = "hand.xml") -> Path:
    path = folder / name
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return path


def with_asset(asset: str, text: str = GOOD) -> str:
    return text.replace("<worldbody>", f"<asset>{asset}</asset><worldbody>", 1)


def in_world(element: str, text: str = GOOD) -> str:
    return text.replace("<worldbody>", f"<worldbody>{element}", 1)


def tetrahedron() -> bytes:
    """A binary STL."""
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]) * 0.01
    faces = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]
    body = b"".join(
        struct.pack("<12fH", 0, 0, 0, *corners[list(face)].ravel(), 0) for face in faces
    )
    return b" " * 80 + struct.pack("<I", len(faces)) + body


def test_names_come_back_in_our_order(tmp_path):
    hand = load_custom_hand(write(tmp_path, GOOD))
    assert hand.joints == JOINTS
    assert hand.actuators == tuple(f"act_{name}" for name in JOINTS)
    assert (hand.palm, hand.root_joint) == ("base", "root")
    assert hand.tip_bodies == ("f1l4", "f2l4", "f3l4", "f4l4", "f5l4")
    assert hand.defaults == ()
    model = hand.spec.compile()
    for body, geom in zip(hand.tip_bodies, hand.tip_geoms, strict=True):
        assert model.geom(geom).bodyid[0] == model.body(body).id


def test_joint_map(tmp_path):
    path = write(tmp_path, hand_xml(prefix="right_"))
    with pytest.raises(InputError, match=r"finger1_joint1 \(near: right_finger1_joint"):
        load_custom_hand(path)
    hand = load_custom_hand(path, JointMap({name: f"right_{name}" for name in JOINTS}))
    assert hand.joints == tuple(f"right_{name}" for name in JOINTS)


@pytest.mark.parametrize(
    ("joint_map", "message"),
    [
        ({"finger1_joint5": "x"}, "did you mean finger1_joint"),
        ({"finger1_joint1": "finger1_joint2"}, "finger1_joint2 twice"),
        ({"finger1_joint1": "thumb"}, "joints thumb"),
    ],
)
def test_wrong_joint_map(tmp_path, joint_map, message):
    with pytest.raises(InputError, match=message):
        load_custom_hand(write(tmp_path, GOOD), JointMap(joint_map))


def test_what_is_filled_in_is_said(tmp_path):
    start, end = GOOD.index("<actuator>"), GOOD.index("</mujoco>")
    text = (GOOD[:start] + GOOD[end:]).replace('<freejoint name="root"/>', "")
    text = text.replace('body name="base"', "body")
    hand = load_custom_hand(write(tmp_path, text))
    assert hand.actuators == () and hand.root_joint == ""
    assert len(hand.defaults) == 2
    assert hand.palm and hand.spec.body(hand.palm) is not None


def test_the_farthest_colliding_geom_is_the_tip(tmp_path):
    tip = (
        '<geom name="shell_{0}" size="0.05" pos="0 0 0.1" contype="0" conaffinity="0"/>'
        '<geom name="near_{0}" size="0.004"/><geom name="far_{0}" size="0.004" '
        'pos="0 0 0.03"/>'
    )
    text = hand_xml(tip="TIP")
    for finger in (5, 4, 3, 2, 1):
        text = text.replace("TIP", tip.format(finger), 1)
    hand = load_custom_hand(write(tmp_path, text))
    assert hand.tip_geoms == tuple(f"far_{finger}" for finger in range(1, 6))


def test_meshes_and_includes_of_the_folder_are_read(tmp_path):
    (tmp_path / "meshes").mkdir()
    write(tmp_path / "meshes", tetrahedron(), "palm.stl")
    write(tmp_path, "<mujoco><option gravity='0 0 -9.8'/></mujoco>", "common.xml")
    text = with_asset('<mesh name="palm" file="palm.stl"/>')
    text = text.replace(
        "<asset>", '<compiler meshdir="meshes"/><include file="common.xml"/><asset>'
    )
    text = in_world('<geom type="mesh" mesh="palm"/>', text)
    assert load_custom_hand(write(tmp_path, text)).joints == JOINTS


ABOVE = ("/etc/passwd", "../x.xml", "~/x.xml", "C:\\x.xml", "&#46;&#46;/x.xml")
ANOTHER_FINGER = '<body><joint name="finger6_joint1" axis="0 1 0" range="0 9"/>'
HOSTILE = {
    # not this hand
    "joint missing": (
        GOOD.replace(HINGE.format(joint="finger2_joint3"), "").replace(
            ACTUATOR.format("finger2_joint3"), ""
        ),
        "joints finger2_joint3",
    ),
    "no joints": ("<mujoco/>", "joints finger1_joint1"),
    "21 joints": (
        in_world(f"{ANOTHER_FINGER}{CAPSULE}</body>"),
        "not finger6_joint1",
    ),
    "slide": (
        GOOD.replace('name="finger1_joint2"', 'name="finger1_joint2" type="slide"'),
        "hinges as finger1_joint2",
    ),
    "no limits": (
        hand_xml(joint='<joint name="{joint}" axis="0 1 0"/>'),
        "limits of finger1_joint1",
    ),
    "one actuator missing": (
        GOOD.replace(ACTUATOR.format("finger3_joint1"), ""),
        "one actuator each on finger3_joint1",
    ),
    "two actuators on a joint": (
        GOOD.replace("</actuator>", '<motor joint="finger3_joint1"/></actuator>'),
        "one actuator each on finger3_joint1",
    ),
    "no tip": (
        hand_xml(tip='<inertial pos="0 0 0" mass="0.1" diaginertia="1 1 1"/>'),
        "a colliding geom on the tip body f1l4",
    ),
    "no palm": (
        GOOD.replace(BASE, "").replace("</body></worldbody>", "</worldbody>"),
        "a palm body",
    ),
    "order in the finger": (
        GOOD.replace("finger4_joint1", "X")
        .replace("finger4_joint3", "finger4_joint1")
        .replace("X", "finger4_joint3"),
        "the joints of the ring",
    ),
    # numbers
    **{
        f"timestep {text}": (GOOD.replace('0.005"', f'{text}"', 1), "timestep")
        for text in ("0", "-1", "nan", "inf", "5 ms", "0x1p+3", "")
    },
    "mass nan": (GOOD.replace('mass="0.3"', 'mass="nan"'), "finite numbers"),
    "mass overflow": (
        hand_xml(
            tip='<inertial pos="0 0 0" mass="1e308" diaginertia="1 1 1"/>' + CAPSULE
        ),
        "is not finite",
    ),
    "inertia overflow": (GOOD.replace('size="0.02"', 'size="1e200"'), ""),
    "mass negative": (GOOD.replace('mass="0.3"', 'mass="-0.3"'), "mass"),
    "mass zero": (GOOD.replace('mass="0.01"', 'mass="0"', 60), "mass"),
    "mass inf": (GOOD.replace('mass="0.3"', 'mass="inf"'), "finite numbers"),
    "range nan": (GOOD.replace('range="0 90"', 'range="nan 1"', 1), "finite"),
    "range reversed": (GOOD.replace('range="0 90"', 'range="90 0"', 1), ""),
    "pos inf": (GOOD.replace('pos="0 0 0.02"', 'pos="inf 0 0"', 1), "finite"),
    "gravity nan": (GOOD.replace("<option", '<option gravity="0 0 nan"'), "finite"),
    "gain nan": (GOOD.replace('kp="1"', 'kp="nan"', 1), "finite"),
    "axis zero": (GOOD.replace('axis="0 1 0"', 'axis="0 0 0"', 1), ""),
    "size negative": (GOOD.replace('size="0.02"', 'size="-1"'), ""),
    # size
    "replicate nested": (in_world('<replicate count="99">' * 9), "copies"),
    "replicate 1e7": (in_world('<replicate count="1e7"/>'), "copies"),
    "flexcomp": (in_world('<flexcomp name="f" count="999 999 999"/>'), "copies"),
    "composite": (in_world('<composite type="cable" count="9999999 1 1"/>'), "copies"),
    "height field": (with_asset('<hfield nrow="99999" ncol="99999"/>'), "8192"),
    "texture": (with_asset('<texture width="99999" height="99999"/>'), "8192"),
    "memory": (GOOD.replace("<option", '<size memory="999G"/><option'), ""),
    "elements": (in_world('<geom size="1"/>' * 20_001), "elements"),
    "depth": (in_world("<body>" * 20_000), "deep"),
    "large file": (GOOD + " " * (8 << 20), "bytes"),
    # files
    **{
        f"include {file}": (in_world(f'<include file="{file}"/>'), "folder")
        for file in (*ABOVE, "link.xml", "sub/deep.xml", "sub/decoy.xml")
    },
    "include absent": (in_world('<include file="none.xml"/>'), "regular file"),
    "include itself": (in_world('<include file="hand.xml"/>'), ""),
    "include folder": (in_world('<include file="."/>'), "regular file"),
    "include pipe": (in_world('<include file="pipe"/>'), "regular file"),
    "include long": (in_world(f'<include file="{"a" * 5000}"/>'), ""),
    **{
        f"mesh {file}": (with_asset(f'<mesh file="{file}"/>'), "folder")
        for file in ("/etc/hosts", "../outside.stl", "http://host/a.stl")
    },
    "mesh through folder": (
        with_asset('<mesh file="outside.stl"/>').replace(
            "<option", '<compiler meshdir=".."/><option'
        ),
        "folder",
    ),
    "mesh absent": (with_asset('<mesh file="none.stl"/>'), "exists"),
    "mesh broken": (with_asset('<mesh file="broken.stl"/>'), "MuJoCo refuses"),
    "mesh pipe": (with_asset('<mesh file="pipe"/>'), "regular file"),
    "texture above": (with_asset('<texture fileup="../a.png"/>'), "folder"),
    "model above": (with_asset('<model name="a" file="../a.xml"/>'), "folder"),
    "plugin": (in_world('<body><plugin plugin="evil.so"/></body>'), "MuJoCo refuses"),
    # text
    "empty": ("", "well-formed"),
    "binary": (bytes(range(256)) * 10, "UTF-8"),
    "utf-16": (GOOD.encode("utf-16"), "UTF-8"),
    "other encoding": ('<?xml version="1.0" encoding="latin-1"?>' + GOOD, "UTF-8"),
    "urdf": ("<robot name='x'/>", "root <mujoco>"),
    "truncated": (GOOD[: len(GOOD) // 2], "well-formed"),
    "unknown element": (in_world("<bodyy/>"), "MuJoCo refuses"),
    "unknown attribute": (GOOD.replace('kp="1"', 'kpp="1"', 1), "MuJoCo refuses"),
    "joint twice": (GOOD.replace("finger1_joint2", "finger1_joint1"), ""),
    "entity bomb": (
        '<!DOCTYPE m [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;">]>' + GOOD,
        "document type",
    ),
    "external entity": (
        '<!DOCTYPE m [<!ENTITY x SYSTEM "file:///etc/passwd">]><mujoco>&x;</mujoco>',
        "document type",
    ),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_and_malformed_models_are_refused(tmp_path, name):
    """Every folder also holds the files that the hostile models reach for."""
    text, message = HOSTILE[name]
    folder = tmp_path / "model"
    folder.mkdir()
    write(tmp_path, tetrahedron(), "outside.stl")
    write(tmp_path, "<mujoco/>", "x.xml")
    write(folder, b"solid" * 40, "broken.stl")
    (folder / "sub").mkdir()
    above = '<mujoco><include file="../../x.xml"/></mujoco>'
    write(folder / "sub", above, "deep.xml")
    write(folder / "sub", '<mujoco><include file="two.xml"/></mujoco>', "decoy.xml")
    write(folder / "sub", above, "two.xml")
    write(folder, "<mujoco/>", "two.xml")
    (folder / "link.xml").symlink_to(tmp_path / "x.xml")
    os.mkfifo(folder / "pipe")
    start = time.process_time()
    with pytest.raises(InputError) as caught:
        load_custom_hand(write(folder, text))
    assert time.process_time() - start < 5.0
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["none.xml", "", "a\0b"])
def test_unreadable_model(tmp_path, name):
    with pytest.raises(InputError):
        load_custom_hand(str(tmp_path / name))


def test_a_link_to_a_model_is_judged_by_the_folder_of_the_model(tmp_path):
    (tmp_path / "model").mkdir()
    text = in_world('<include file="x.xml"/>')
    write(tmp_path / "model", "<mujoco><light/></mujoco>", "x.xml")
    write(tmp_path, "<mujoco><broken/></mujoco>", "x.xml")
    link = tmp_path / "hand.xml"
    link.symlink_to(write(tmp_path / "model", text))
    assert load_custom_hand(link).joints == JOINTS


def test_compilation_has_a_time_limit(tmp_path):
    """The hulls of 60,000 points on a sphere take a second or more each."""
    points = np.random.default_rng(SEED).normal(size=(60_000, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    vertices = " ".join(f"{number:.5f}" for number in points.ravel())
    names = "abcde"
    meshes = "".join(f'<mesh name="{n}" vertex="{vertices}"/>' for n in names)
    geoms = "".join(f'<geom type="mesh" mesh="{n}"/>' for n in names)
    path = write(tmp_path, in_world(geoms, with_asset(meshes)))
    with pytest.raises(InputError, match="within 1 s of processor time"):
        load_custom_hand(path, cpu_limit_s=1)


def mutate(rng: random.Random, text: str) -> bytes:
    content = bytearray(text.encode())
    for _ in range(rng.randint(1, 3)):
        at = rng.randrange(len(content))
        kind = rng.randrange(4)
        if kind == 0:
            content[at] ^= 1 << rng.randrange(8)
        elif kind == 1:
            del content[at : at + rng.randint(1, 30)]
        elif kind == 2:
            content[at:at] = rng.choice([b"nan", b"-1", b"<", b'"', b"1e999", b"/>"])
        else:
            del content[at:]
    return bytes(content)


def fuzz(tmp_path: Path, count: int) -> int:
    print(f"seed {SEED}")
    rng, refused = random.Random(SEED), 0
    for _ in range(count):
        start = time.process_time()
        try:
            hand = load_custom_hand(write(tmp_path, mutate(rng, GOOD)))
        except InputError:
            refused += 1
        else:
            assert hand.joints == JOINTS
        assert time.process_time() - start < 5.0
    return refused


def test_mutated_models(tmp_path):
    assert fuzz(tmp_path, 20) > 10


@pytest.mark.slow
def test_mutated_models_many(tmp_path):
    assert fuzz(tmp_path, 500) > 250
