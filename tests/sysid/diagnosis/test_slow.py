"""Records whose rows are too far apart for a motion: what the rests show."""

import numpy as np
import pytest

from envs.physics.quiet_mujoco import mujoco
from sysid.diagnosis.diagnose import diagnose
from sysid.drive import JointDrive, Nominal
from sysid.logs.log import make_log
from sysid.mechanism import model_mechanism

SEED = int.from_bytes(np.random.default_rng().bytes(3))
ARM = """
<mujoco><worldbody><body><joint name="servo"/>
<inertial pos="0 0 0" mass="0.1" diaginertia="1e-3 1e-3 1e-3"/>
</body></worldbody></mujoco>"""
KP, PULLS = 5.0, 160


def pulled(half_width_rad):
    """Ten rows a second of a servo that holds while somebody pulls to and fro.

    A pull moves the joint within a row or two, in which the reading of the effort is
    of another moment than that of the angle.
    """
    print(f"seed {SEED}")
    rng = np.random.default_rng(SEED)
    hold = rng.integers(5, 9, PULLS)
    pull = rng.uniform(0.01, 0.08, PULLS) * (-1.0) ** np.arange(PULLS)
    error = np.repeat(pull, hold)
    t_s = 0.1 * np.arange(len(error))
    effort = KP * np.sign(error) * np.maximum(np.abs(error) - half_width_rad, 0.0)
    effort += rng.normal(0.0, 2e-3, len(error))
    late = np.append(False, np.diff(error) != 0.0)
    effort[late] = rng.uniform(-1.0, 1.0, late.sum())
    columns = {"cmd.servo": 0.0 * t_s, "pos.servo": -error, "tau.servo": effort}
    return make_log(("servo",), t_s, columns)


def held():
    drive = JointDrive(Nominal(KP, 0.05), Nominal(1e-6, 10.0), known="controller")
    model = mujoco.MjModel.from_xml_string(ARM)
    return model_mechanism(model, {"servo": drive})


def test_a_deadband_is_found_in_the_rests():
    width = np.random.default_rng([SEED, 1]).uniform(0.002, 0.005)
    said = diagnose([pulled(width)], held())
    assert [c.effect for c in said.causes] == ["deadband"]
    assert said.causes[0].parameters["half_width_rad"].value == pytest.approx(
        width, rel=0.1
    )


def test_without_it_nothing_is_found():
    """Negative control."""
    assert not diagnose([pulled(0.0)], held()).causes


def test_without_the_effort_nothing_can_be_said():
    log = pulled(0.004)
    columns = {k: v for k, v in log.columns.items() if not k.startswith("tau")}
    drive = JointDrive(Nominal(KP, 0.05), Nominal(0.1, 0.1), effort="none")
    model = mujoco.MjModel.from_xml_string(ARM)
    mechanism = model_mechanism(model, {"servo": drive})
    said = diagnose([make_log(("servo",), log.t_s, columns)], mechanism)
    assert said.verdict == "not_observable"
    assert "too fast for their rows" in said.warnings[0]
