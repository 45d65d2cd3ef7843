"""Sizes that cannot fit are refused with a number, before JAX is loaded."""

import dataclasses
import json
import subprocess
import sys

import pytest

from envs.errors import InputError
from fingers_mjx.ppo.config import PRESETS, PpoConfig, TrainConfig
from fingers_mjx.training import memory
from fingers_mjx.training.memory import check_memory, needed_bytes


def test_the_least_memory_of_a_small_network_by_hand():
    ppo = PpoConfig(unroll_length=2, actor_layers=(8,), critic_layers=(4,))
    config = TrainConfig(num_envs=3, ppo=ppo)
    actor = 392 * 8 + 8 + 8 * 40 + 40
    critic = 392 * 4 + 4 + 4 * 1 + 1
    data = 2 * 3 * 2 * (392 + 40)
    assert needed_bytes(config) == 4 * (4 * (actor + critic) + data)
    assert needed_bytes(config, 5) == 5 * needed_bytes(config)


@pytest.mark.parametrize("name", PRESETS)
def test_every_preset_fits_into_a_small_machine(name, monkeypatch):
    monkeypatch.setattr(memory, "machine_bytes", lambda: 8 << 30)
    check_memory(PRESETS[name]())


def test_what_does_not_fit_is_refused_with_the_number(monkeypatch):
    monkeypatch.setattr(memory, "machine_bytes", lambda: 10**9)
    config = dataclasses.replace(PRESETS["paper"](), num_envs=2**20)
    with pytest.raises(InputError, match=r"at least 87\.\d GB .* valid: 1\.0 GB"):
        check_memory(config)


def test_a_group_of_processes_may_have_less_than_the_machine(monkeypatch, tmp_path):
    group = tmp_path / "memory.max"
    monkeypatch.setattr(memory, "_GPU", tmp_path / "none")
    monkeypatch.setattr(memory, "_GROUP", group)
    whole = memory.machine_bytes()
    for text, found in (("max\n", whole), ("123456\n", 123456), ("", whole)):
        group.write_text(text)
        assert memory.machine_bytes() == found


_PROGRAM = """
import json, sys
from fingers_mjx.cli.main import main
status = main(json.loads(sys.argv[1]))
print(status, 'jax' in sys.modules)
"""


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        ("ppo.actor_layers=[60000,60000,60000]", "GB of memory needed"),
        ("ppo.actor_layers=[100000000]", "65536"),
        ("ppo.unroll_length=1000000000", "65536"),
        ("ppo.epochs=99999999999999999999999", "65536"),
    ],
)
def test_the_command_refuses_it_before_jax_is_loaded(setting, words, tmp_path):
    arguments = json.dumps(["train", "crawl", "--set", setting])
    done = subprocess.run(
        [sys.executable, "-c", _PROGRAM, arguments],
        capture_output=True,
        text=True,
        check=True,
        cwd=tmp_path,
    )
    assert done.stdout == "2 False\n" and words in done.stderr
    assert len(done.stderr.splitlines()) == 1 and list(tmp_path.iterdir()) == []
