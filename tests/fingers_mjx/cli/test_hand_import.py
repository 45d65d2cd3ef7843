"""`fingers hand import`: a hand file from an MJCF, or one sentence."""

import mujoco
import pytest
from support.cli_setup import contents

from envs.hand.hand_file import load_hand_file
from envs.hand.model import build_spec
from envs.hand.nominal import vendor_hand
from fingers_mjx.cli.main import main


@pytest.fixture
def here(tmp_path, monkeypatch):
    """A directory with our hand as `hand.xml`, its thumb's first joint renamed."""
    monkeypatch.chdir(tmp_path)
    spec = build_spec(load_hand_file())
    spec.compile()
    text = spec.to_xml().replace('"finger1_joint1"', '"thumb_cmc"')
    (tmp_path / "hand.xml").write_text(text)
    (tmp_path / "map.yaml").write_text("joints: {finger1_joint1: thumb_cmc}\n")
    return tmp_path


IMPORT = ["hand", "import", "hand.xml", "-o", "my.yaml"]
MAPPED = [*IMPORT, "--joint-map", "map.yaml"]


def test_a_hand_of_ones_own_is_imported_and_stands(here, capsys):
    assert main(MAPPED) == 0
    said = capsys.readouterr().out.splitlines()
    assert said[-2:] == [
        "stands under the stored joint targets, the palm 127.4 mm up",
        "wrote my.yaml",
    ]
    hand = load_hand_file(here / "my.yaml")
    assert hand.nominal.joint_names == vendor_hand().joint_names
    assert main(["hand", "mjcf", "--hand", "my.yaml", "-o", "again.xml"]) == 0
    again = mujoco.MjModel.from_xml_path("again.xml")
    assert again.body_mass.sum() == pytest.approx(0.818, abs=1e-6)


@pytest.mark.parametrize(
    ("files", "argv", "words"),
    [
        ({}, IMPORT, ["hand.xml", "joints finger1_joint1"]),
        ({}, IMPORT[:-2], ["-o/--out", "required"]),
        ({}, [*IMPORT[:2], "no.xml", *IMPORT[3:]], ["no.xml", "readable MJCF"]),
        ({"map.yaml": "joint: {}"}, MAPPED, ["map.yaml: joint", "joints"]),
        ({"map.yaml": "joints: {x: y}"}, MAPPED, ["joint_map: x", "one of finger1_"]),
        ({"map.yaml": "palm_quat: [1, 1, 0, 0]"}, MAPPED, ["palm_quat", "length 1"]),
        ({"map.yaml": "palm_quat: [1, 0, 0]"}, MAPPED, ["palm_quat", "of 4"]),
        ({"map.yaml": "[1"}, MAPPED, ["map.yaml", "strict YAML"]),
        ({"hand.xml": "<mujoco/>"}, IMPORT, ["hand.xml", "joints finger1_joint1"]),
        (
            {
                "map.yaml": "joints: {finger1_joint1: thumb_cmc}\n"
                "palm_quat: [0, 1, 0, 0]"
            },
            MAPPED,
            ["joint axes", "thumb_cmc", "45°"],
        ),
    ],
)
def test_what_is_missing_is_named_and_nothing_written(here, capsys, files, argv, words):
    for name, text in files.items():
        (here / name).write_text(text)
    before = contents(here)
    assert main(argv) == 2
    said = capsys.readouterr()
    assert contents(here) == before
    assert said.err.startswith("fingers: ") and said.err.count("\n") == 1
    assert all(word in said.err for word in words), said.err
    assert said.out == ""
