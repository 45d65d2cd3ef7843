"""A user's model with all joints at zero, and our frames in it."""

from dataclasses import dataclass

from envs.hand.importing.inertia import groups
from envs.hand.importing.load import CustomHand
from envs.hand.importing.own_frames import Hinges, own_link_frames, own_palm_frame
from envs.hand.importing.palm import Frame, link_frames, palm_frame
from envs.physics.quiet_mujoco import mujoco


@dataclass(frozen=True)
class Placed:
    """A user's model with all joints at zero and our frames in it.

    Attributes:
        custom: the checked model.
        model: compiled.
        data: pose with all hinges at zero.
        joints: the hinges.
        palm: our palm frame in the model's palm body.
        palm_w: the same in the world.
        links: the links in our palm frame.
        bodies: what moves with each link, palm and payload.
    """

    custom: CustomHand
    model: mujoco.MjModel
    data: mujoco.MjData
    joints: list[int]
    palm: Frame
    palm_w: Frame
    links: list[Frame]
    bodies: dict[int, list[int]]

    @property
    def each(self) -> int:
        """Links of each finger."""
        return len(self.joints) // len(self.custom.tip_bodies)

    def link_w(self, index: int) -> Frame:
        """Frame of a link in the world."""
        return self.palm_w.of(self.links[index])


def place(
    custom: CustomHand,
    palm_quat: tuple[float, ...] | None = None,
    like_vendor: bool = True,
) -> Placed:
    """Puts our frames into a user's model.

    Args:
        custom: the checked model.
        palm_quat: our palm frame in the model's palm body, w x y z, where it is given.
        like_vendor: whether the hand is built as the vendor's, which it then must be.

    Raises:
        InputError: see `palm_frame` and `link_frames`, or `own_palm_frame` and
            `own_link_frames`.
    """
    model = custom.spec.compile()
    data = mujoco.MjData(model)
    joints = [model.joint(name).id for name in custom.joints]
    data.qpos[model.jnt_qposadr[joints]] = 0.0
    mujoco.mj_kinematics(model, data)
    body = model.body(custom.palm).id
    palm_body_w = Frame(data.xpos[body].copy(), data.xmat[body].reshape(3, 3).copy())
    world = _hinges(custom, model, data, joints)
    in_body = world.moved_into(palm_body_w)
    if like_vendor:
        palm = palm_frame(custom.path, in_body.anchors, palm_quat)
    else:
        palm = own_palm_frame(in_body, palm_quat)
    palm_w = palm_body_w.of(palm)
    ours = world.moved_into(palm_w)
    if like_vendor:
        links = link_frames(custom.path, ours.anchors, ours.axes, custom.joints)
    else:
        links = own_link_frames(ours)
    root = (
        model.jnt_bodyid[model.joint(custom.root_joint).id]
        if custom.root_joint
        else body
    )
    carried = groups(model, model.jnt_bodyid[joints].tolist(), body, int(root))
    return Placed(custom, model, data, joints, palm, palm_w, links, carried)


def _hinges(
    custom: CustomHand, model: mujoco.MjModel, data: mujoco.MjData, joints: list[int]
) -> Hinges:
    """The hinges as they stand in the world."""
    tips = data.geom_xpos[[model.geom(name).id for name in custom.tip_geoms]]
    axes, ranges = data.xaxis[joints], model.jnt_range[joints]
    return Hinges(custom.path, custom.joints, data.xanchor[joints], axes, tips, ranges)
