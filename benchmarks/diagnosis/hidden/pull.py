"""A fingertip under a weight, drawn over a floor through a load cell."""

import mujoco
import numpy as np

from sysid.logs.log import MeasuredLog, make_log

_MODEL = """
<mujoco><option timestep="0.0005" cone="elliptic" impratio="20"/>
<worldbody><geom type="plane" size="1 1 0.1" friction="{friction} 0.005 0.0001"/>
<body pos="0 0 0.0085"><joint name="x" type="slide" axis="1 0 0"/>
<joint name="z" type="slide" axis="0 0 1"/>
<geom type="sphere" size="0.0085" mass="{mass}" friction="{friction} 0.005 0.0001"/>
</body></worldbody></mujoco>
"""
CELL_NM, SPEED_M_S = 800.0, 0.02


def pull(friction: float, normal_n: float, rng: np.random.Generator) -> MeasuredLog:
    """Returns the log of one pull of 4 s: rest, build-up, sliding, release."""
    text = _MODEL.format(friction=friction, mass=normal_n / 9.81)
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    force = []
    for k in range(8000):
        t = k * 0.0005
        drawn = SPEED_M_S * np.clip(t - 0.5, 0.0, 3.0)
        stretch = 0.0 if t > 3.5 else CELL_NM * (drawn - data.qpos[0])
        data.qfrc_applied[0] = stretch - 2.0 * data.qvel[0]
        force.append(stretch)
        mujoco.mj_step(model, data)
    t_s = np.arange(0.0, 4.0, 0.01)
    read = np.array(force)[::20] + rng.normal(0.0, 0.02, t_s.size)
    still = np.zeros(t_s.size)
    columns = {"cmd.tip": still, "pos.tip": still, "force.index": read}
    return make_log(("tip",), t_s, columns, settings={"normal_n": normal_n})
