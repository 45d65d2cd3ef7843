"""The sensors of the hand's model, and the names of what they stand on."""

from envs.hand.hand_file import HandFile
from envs.physics.quiet_mujoco import mujoco

FLOOR, PALM, PAYLOAD = "floor", "palm", "payload"
V_SITE = "control_frame"


def add_sensors(spec: mujoco.MjSpec, hand: HandFile) -> None:
    """Adds what `envs.signals` reads; names are `<quantity>_<object>`."""
    frame = {
        "quat": mujoco.mjtSensor.mjSENS_FRAMEQUAT,
        "pos": mujoco.mjtSensor.mjSENS_FRAMEPOS,
        "linvel": mujoco.mjtSensor.mjSENS_FRAMELINVEL,
        "angvel": mujoco.mjtSensor.mjSENS_FRAMEANGVEL,
    }
    sites = [(V_SITE, ("pos", "quat", "linvel", "angvel"))]
    sites += [(f"{f}_tip", ("pos", "quat", "linvel")) for f in hand.nominal.fingers]
    for site, kinds in sites:
        for kind in kinds:
            spec.add_sensor(
                name=f"{kind}_{site}",
                type=frame[kind],
                objtype=mujoco.mjtObj.mjOBJ_SITE,
                objname=site,
            )
    for link in hand.nominal.links:
        spec.add_sensor(
            name=f"torque_{link.joint}",
            type=mujoco.mjtSensor.mjSENS_JOINTACTFRC,
            objtype=mujoco.mjtObj.mjOBJ_JOINT,
            objname=link.joint,
        )
    for link in hand.nominal.links:
        if link.tip:
            _add_contact_sensor(spec, f"{link.body}_tip", force=True)
    for link in hand.nominal.links:
        if link.capsule and not link.tip:
            _add_contact_sensor(spec, link.body, force=False)
    _add_contact_sensor(spec, PALM, force=False)
    _add_contact_sensor(spec, PAYLOAD, force=False)


def _add_contact_sensor(spec: mujoco.MjSpec, geom: str, force: bool) -> None:
    """Adds the contact force with the floor, or the number of contacts with it.

    A sphere meets a plane in one point, so the force of one contact is all of it.
    """
    data = mujoco.mjtConDataField
    field = data.mjCONDATA_FORCE if force else data.mjCONDATA_FOUND
    mindist = 1  # MJX matches geoms only where it also sorts
    spec.add_sensor(
        name=f"{'force' if force else 'found'}_{geom}",
        type=mujoco.mjtSensor.mjSENS_CONTACT,
        objtype=mujoco.mjtObj.mjOBJ_GEOM,
        objname=geom,
        reftype=mujoco.mjtObj.mjOBJ_GEOM,
        refname=FLOOR,
        intprm=[1 << int(field), mindist, 1],
    )
