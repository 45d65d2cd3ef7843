"""A user's model with all joints at zero, and our frames in it."""

from dataclasses import dataclass

from envs.hand.importing.inertia import groups
from envs.hand.importing.load import CustomHand
from envs.hand.importing.palm import Frame, link_frames, palm_frame
from envs.physics.quiet_mujoco import mujoco


@dataclass(frozen=True)
class Placed:
    """A user's model with all joints at zero and our frames in it.

    Attributes:
        custom: the checked model.
        model: compiled.
        data: pose with all hinges at zero.
        joints: the 20 hinges.
        palm: our palm frame in the model's palm body.
        palm_w: the same in the world.
        links: the 20 links in our palm frame.
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

    def link_w(self, index: int) -> Frame:
        """Frame of a link in the world."""
        return self.palm_w.of(self.links[index])


def place(custom: CustomHand, palm_quat: tuple[float, ...] | None = None) -> Placed:
    """Puts our frames into a user's model.

    Raises:
        InputError: see `palm_frame` and `link_frames`.
    """
    model = custom.spec.compile()
    data = mujoco.MjData(model)
    joints = [model.joint(name).id for name in custom.joints]
    data.qpos[model.jnt_qposadr[joints]] = 0.0
    mujoco.mj_kinematics(model, data)
    body = model.body(custom.palm).id
    palm_body_w = Frame(data.xpos[body].copy(), data.xmat[body].reshape(3, 3).copy())
    anchors = (data.xanchor[joints] - palm_body_w.pos) @ palm_body_w.mat
    palm = palm_frame(custom.path, anchors, palm_quat)
    palm_w = palm_body_w.of(palm)
    anchors = (data.xanchor[joints] - palm_w.pos) @ palm_w.mat
    axes = data.xaxis[joints] @ palm_w.mat
    links = link_frames(custom.path, anchors, axes, custom.joints)
    root = (
        model.jnt_bodyid[model.joint(custom.root_joint).id]
        if custom.root_joint
        else body
    )
    carried = groups(model, model.jnt_bodyid[joints].tolist(), body, int(root))
    return Placed(custom, model, data, joints, palm, palm_w, links, carried)
