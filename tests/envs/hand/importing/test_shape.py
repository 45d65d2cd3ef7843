"""Capsules in the place of a user's geoms."""

import mujoco
import numpy as np
import pytest

from envs.hand.importing.palm import Frame
from envs.hand.importing.shape import colliding_geoms, link_capsule

# All with the bounds of a capsule from 6 to 34 mm along z, 6 mm thick.
SHAPES = {
    "box": '<geom type="box" size=".007 .005 .02" pos="0 0 .02"/>',
    "cylinder": '<geom type="cylinder" size=".006 .02" pos="0 0 .02"/>',
    "ellipsoid": '<geom type="ellipsoid" size=".006 .006 .02" pos="0 0 .02"/>',
    "capsule": '<geom type="capsule" size=".006" fromto="0 0 .034 0 0 .006"/>',
    "capsule with a tip": '<geom size=".006" pos="0 0 .034"/>'
    '<geom type="capsule" size=".006" fromto="0 0 .006 0 0 .034"/>',
    "two balls": '<geom size=".006" pos="0 0 .006"/><geom size=".006" pos="0 0 .034"/>',
    "box with a picture": '<geom type="box" size=".006 .006 .02" pos="0 0 .02"/>'
    '<geom size=".05" contype="0" conaffinity="0"/>',
}


def capsule_of(geoms, turn="1 0 0 0"):
    """The capsule of a body that is turned, in a frame that turns with it."""
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><worldbody><body pos="0 0 1"><body quat="{turn}">{geoms}'
        "</body></body></worldbody></mujoco>"
    )
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    frame = Frame(np.array([0.0, 0.0, 1.0]), data.xmat[2].reshape(3, 3))
    return link_capsule(model, data, colliding_geoms(model, [2]), frame)


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("turn", ["1 0 0 0", "0.5 -0.5 0.1 0.7"])
def test_a_capsule_has_the_bounds_of_the_geoms(shape, turn):
    start, end, radius = capsule_of(SHAPES[shape], turn)
    np.testing.assert_allclose(start, [0, 0, 0.006], atol=1e-9)
    np.testing.assert_allclose(end, [0, 0, 0.034], atol=1e-9)
    assert radius == pytest.approx(0.006, abs=1e-9)


def test_it_lies_along_the_longest_axis_away_from_the_hinge():
    geom = '<geom type="box" size=".006 .006 .02" pos=".01 0 -.02" euler="0 30 0"/>'
    start, end, radius = capsule_of(geom)
    along = np.subtract(end, start)
    assert np.linalg.norm(end) > np.linalg.norm(start)
    wanted = np.array([np.sin(np.pi / 6), 0.0, np.cos(np.pi / 6)])
    assert abs(along @ wanted) == pytest.approx(np.linalg.norm(along))
    np.testing.assert_allclose(np.add(start, end) / 2, [0.01, 0, -0.02], atol=1e-9)
    assert radius == pytest.approx(0.006)


def test_a_ball_becomes_a_capsule_as_short_as_can_be():
    start, end, radius = capsule_of('<geom size=".006" pos="0 .01 .02"/>')
    assert np.linalg.norm(np.subtract(end, start)) == pytest.approx(0.001)
    np.testing.assert_allclose(np.add(start, end) / 2, [0, 0.01, 0.02], atol=1e-9)
    assert radius == pytest.approx(0.006, abs=1e-4)
