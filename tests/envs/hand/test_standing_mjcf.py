"""The hand as MJCF: what `fingers-deploy run --driver sim --model` reads."""

import mujoco
import numpy as np
import pytest

from envs.hand.hand_file import DEFAULT_HAND_FILE
from envs.hand.nominal import vendor_hand
from envs.hand.stance import load_stance
from fingers_mjx.cli.main import main
from fingers_robot.simulator.hand import SimulatedHand


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    path = tmp_path_factory.mktemp("mjcf") / "new" / "hand.xml"
    assert main(["hand", "mjcf", "-o", str(path)]) == 0
    return path


def test_the_simulated_hand_reads_it_and_stands(model):
    hand = SimulatedHand(model, vendor_hand().joint_names)
    hand.set_enabled(True)
    hand.target_rad = np.array(load_stance().target_rad)
    hand.advance(6.0)
    settled = load_stance().qpos
    np.testing.assert_allclose(hand.data.qpos[:7], settled[:7], atol=5e-4)


def test_without_a_file_it_is_printed(model, capsys):
    assert main(["hand", "mjcf"]) == 0
    assert capsys.readouterr().out == model.read_text()


def test_another_hand_gives_another_model(model, tmp_path):
    heavy, path = tmp_path / "heavy.yaml", tmp_path / "heavy.xml"
    text = DEFAULT_HAND_FILE.read_text(encoding="utf-8")
    assert text.count("{value: 0.08,") == 1
    heavy.write_text(text.replace("{value: 0.08,", "{value: 0.12,"))
    assert main(["hand", "mjcf", "--hand", str(heavy), "--out", str(path)]) == 0
    light, more = (
        mujoco.MjModel.from_xml_path(str(file)).body_mass.sum()
        for file in (model, path)
    )
    assert more - light == pytest.approx(0.04, abs=1e-6)
