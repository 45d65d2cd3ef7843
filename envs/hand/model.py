"""The MuJoCo model of the hand: primitives of its nominal size, sensors for signals.

Geometry is our own: one capsule per finger link (link 1, inside the palm's reach, may
carry none), a box for the palm and one for the dorsal module. A fingertip meets the
floor with a sphere, the end of its capsule: the sides of MuJoCo's friction pyramid lie
along a capsule that stands up in C MuJoCo and along the world's axes in MJX and Warp,
which for a sphere do the same as C. Everything that two hands may differ in comes from
the hand file.
"""

import itertools

import numpy as np
from jaxtyping import Float

from envs.config.settings.hand import PHYSICS_DT_S as PHYSICS_DT_S
from envs.hand.effect_parts import add_effect_parts
from envs.hand.hand_file import HandFile
from envs.hand.model_sensors import FLOOR, PALM, PAYLOAD, V_SITE, add_sensors
from envs.hand.nominal import FINGERS, Link, NominalHand
from envs.physics.quiet_mujoco import mujoco

# Contact groups as bits: what stands on the floor, and what the hand meets otherwise.
_FLOOR_BIT, _HAND_BIT = 1, 2

_COLOURS = {
    "thumb": (0.80, 0.40, 0.00, 1.0),
    "index": (0.00, 0.45, 0.70, 1.0),
    "middle": (0.00, 0.62, 0.45, 1.0),
    "ring": (0.80, 0.47, 0.65, 1.0),
    "little": (0.90, 0.62, 0.00, 1.0),
}
_PALM_COLOUR = (0.82, 0.82, 0.84, 1.0)
_PAYLOAD_COLOUR = (0.25, 0.27, 0.30, 1.0)


def build_spec(
    hand: HandFile, q_off: Float[np.ndarray, "4"] | None = None
) -> mujoco.MjSpec:
    """Builds the scene: floor, hand with a free root, position drives and sensors.

    Drives compute τ = clip(kp (c − q) − kd q̇, ±τ_max) [N·m].

    Args:
        hand: the hand file.
        q_off: orientation of the control frame V in the palm, w x y z, of length 1 [1];
            identity when the stance is not known yet.

    Returns:
        An uncompiled specification; `spec.to_xml()` after `compile()` gives the MJCF.

    Source:
        WUJI right hand description 2026.04.27 and the hand file; geometry ours.
    """
    spec = mujoco.MjSpec()
    spec.modelname = "wuji_right_primitive"
    _set_options(spec)
    _add_floor(spec, hand)
    palm = _add_palm(spec, hand, q_off)
    parent, each = palm, hand.nominal.links_per_finger
    for index, link in enumerate(hand.nominal.links):
        finger, place = divmod(index, each)
        parent = _add_link(parent if place else palm, link, FINGERS[finger], hand)
        _add_drive(spec, link, index, hand)
    _exclude_neighbours(spec, hand.nominal)
    add_sensors(spec, hand)
    add_effect_parts(spec, hand, FLOOR)
    return spec


def build_model(
    hand: HandFile, q_off: Float[np.ndarray, "4"] | None = None
) -> mujoco.MjModel:
    """Compiles `build_spec`: model = compile(spec(hand, V)) [m, kg, s, rad].

    Args:
        hand: the hand file.
        q_off: orientation of the control frame V in the palm, w x y z [1].

    Source:
        See `build_spec`.
    """
    return build_spec(hand, q_off).compile()


def _set_options(spec: mujoco.MjSpec) -> None:
    spec.compiler.autolimits = False
    spec.compiler.degree = False
    spec.option.timestep = PHYSICS_DT_S
    # The stiff servo (19 × nominal) needs its damping integrated implicitly.
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.cone = mujoco.mjtCone.mjCONE_PYRAMIDAL
    spec.option.iterations = 20
    spec.option.ls_iterations = 20


def _add_floor(spec: mujoco.MjSpec, hand: HandFile) -> None:
    spec.worldbody.add_light(pos=[0, 0, 2], dir=[0, 0, -1])
    spec.worldbody.add_geom(
        name=FLOOR,
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=[0, 0, 0.05],
        friction=[hand.link_friction.value, 0.005, 0.0001],
        condim=3,
        contype=_FLOOR_BIT,
        conaffinity=0,
        rgba=[0.92, 0.92, 0.90, 1],
    )


def _add_palm(
    spec: mujoco.MjSpec, hand: HandFile, q_off: Float[np.ndarray, "4"] | None
) -> mujoco.MjsBody:
    nominal = hand.nominal.palm
    mass = hand.palm_mass.value
    palm = spec.worldbody.add_body(
        name=PALM,
        mass=mass,
        ipos=np.add(nominal.inertial_pos, hand.palm_com_offset.value),
        iquat=nominal.inertial_quat,
        # The nominal inertia belongs to the vendor's lighter palm: same shape, scaled.
        inertia=np.multiply(nominal.diaginertia, mass / nominal.mass),
        explicitinertial=True,
    )
    palm.add_freejoint(name="root")
    low, high = np.array(nominal.bounds_min), np.array(nominal.bounds_max)
    _add_box(palm, PALM, (low + high) / 2, (high - low) / 2, _PALM_COLOUR, hand)
    palm.add_site(
        name=V_SITE, quat=[1, 0, 0, 0] if q_off is None else q_off, size=[0.004]
    )
    _add_payload(palm, hand)
    return palm


def _add_payload(palm: mujoco.MjsBody, hand: HandFile) -> None:
    half = np.array(hand.payload_size.value) / 2
    mass = hand.payload_mass.value
    inertia = mass / 3 * (np.sum(half**2) - half**2)  # of a solid box
    payload = palm.add_body(
        name=PAYLOAD,
        pos=hand.payload_pos.value,
        # Left out, the compiler would take the frame's pose for that of the inertia.
        ipos=[0, 0, 0],
        iquat=[1, 0, 0, 0],
        mass=mass,
        inertia=inertia,
        explicitinertial=True,
    )
    _add_box(payload, PAYLOAD, np.zeros(3), half, _PAYLOAD_COLOUR, hand)


def _add_box(body, name, pos, half, rgba, hand) -> None:
    body.add_geom(
        name=name,
        type=mujoco.mjtGeom.mjGEOM_BOX,
        pos=pos,
        size=half,
        rgba=rgba,
        mass=0,
        condim=3,
        contype=_HAND_BIT,
        conaffinity=_HAND_BIT | _FLOOR_BIT,
        priority=1,
        friction=[hand.link_friction.value, 0.005, 0.0001],
    )


def _add_link(
    parent: mujoco.MjsBody, link: Link, finger: str, hand: HandFile
) -> mujoco.MjsBody:
    body = parent.add_body(
        name=link.body,
        pos=link.pos,
        quat=link.quat,
        mass=link.mass,
        ipos=link.inertial_pos,
        iquat=link.inertial_quat,
        inertia=link.diaginertia,
        explicitinertial=True,
    )
    body.add_joint(
        name=link.joint,
        type=mujoco.mjtJoint.mjJNT_HINGE,
        axis=[0, 1, 0],
        range=link.range_rad,
        limited=True,
        armature=link.armature,
    )
    if link.capsule:
        _add_capsule(body, link, finger, hand)
    return body


def _add_capsule(body: mujoco.MjsBody, link: Link, finger: str, hand: HandFile) -> None:
    """Adds the capsule of a link; on a fingertip also its sphere and its site."""
    assert link.capsule is not None
    start, end, radius = link.capsule
    friction = (hand.tip_friction if link.tip else hand.link_friction).value
    common = {
        "mass": 0,
        "condim": 3,
        "priority": 1,
        "friction": [friction, 0.005, 0.0001],
        "rgba": _COLOURS[finger],
    }
    body.add_geom(
        name=link.body,
        type=mujoco.mjtGeom.mjGEOM_CAPSULE,
        fromto=[*start, *end],
        size=[radius, 0, 0],
        contype=_HAND_BIT,
        conaffinity=_HAND_BIT if link.tip else _HAND_BIT | _FLOOR_BIT,
        **common,
    )
    if link.tip:
        body.add_geom(
            name=f"{link.body}_tip",
            type=mujoco.mjtGeom.mjGEOM_SPHERE,
            pos=end,
            size=[radius, 0, 0],
            contype=0,
            conaffinity=_FLOOR_BIT,
            **common,
        )
        body.add_site(name=f"{finger}_tip", pos=link.tip, size=[0.002])


def _add_drive(spec: mujoco.MjSpec, link: Link, index: int, hand: HandFile) -> None:
    """Adds the position servo: torque = kp (command − q) − kd q̇, clipped."""
    kp = link.kp * hand.per_joint("stiffness_scale")[index]
    kd = link.kv * hand.per_joint("damping_scale")[index]
    limit = link.force_limit * hand.per_joint("torque_scale")[index]
    spec.add_actuator(
        name=link.joint,
        target=link.joint,
        trntype=mujoco.mjtTrn.mjTRN_JOINT,
        gaintype=mujoco.mjtGain.mjGAIN_FIXED,
        gainprm=[kp] + [0.0] * 9,
        biastype=mujoco.mjtBias.mjBIAS_AFFINE,
        biasprm=[0.0, -kp, -kd] + [0.0] * 7,
        forcerange=[-limit, limit],
        forcelimited=True,
        ctrlrange=link.range_rad,
        ctrllimited=True,
    )


def _exclude_neighbours(spec: mujoco.MjSpec, hand: NominalHand) -> None:
    """Excludes pairs that overlap by construction: each finger's base and the palm."""
    for finger in range(1, len(hand.fingers) + 1):
        for other in (PALM, PAYLOAD):
            spec.add_exclude(bodyname1=other, bodyname2=f"finger{finger}_link2")
    bases = [k.body for k in hand.links[:: hand.links_per_finger] if k.capsule]
    for one, other in itertools.combinations(bases, 2):  # fixed side by side
        spec.add_exclude(bodyname1=one, bodyname2=other)
    # The thumb's first free link lies along the index's base.
    for other in range(2, min(4, hand.links_per_finger)):
        spec.add_exclude(bodyname1=PALM, bodyname2=f"finger1_link{other}")
