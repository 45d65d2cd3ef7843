"""The demonstration, as small as it can be: every part of it in one report."""

import re
from dataclasses import replace
from types import SimpleNamespace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from support.cli_setup import TRAIN, make_bundle, make_setup

from fingers_mjx.cli.main import main
from fingers_mjx.demo.demo import DemoSize
from fingers_mjx.demo.explore import Exploring
from fingers_mjx.demo.learn import LearnSize
from fingers_mjx.demo.show import ShowSize
from fingers_mjx.policy.source import load_source

SIZE = DemoSize(
    ShowSize(episodes=2, steps=60, film_s=0.4, fps=10, width=96),
    LearnSize(replace(TRAIN, iterations=2), episodes=4, steps=20),
)


@pytest.fixture(scope="module")
def shown(tmp_path_factory):
    path = tmp_path_factory.mktemp("demo")
    bundle = make_bundle(path / "policy", make_setup())
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("fingers_mjx.demo.demo.DemoSize", lambda: SIZE)
        argv = ["demo", "--out", str(path / "out"), "--policy", str(bundle)]
        assert main(argv) == 0
    return path / "out"


def test_everything_is_there(shown):
    names = {p.name for p in shown.iterdir()}
    runs = [n for n in names if n.startswith("run-")]
    assert names == {"evaluation", "walk.mp4", "report.html", *runs}
    assert len(runs) == 1
    run = shown / runs[0]
    assert load_source(run).steps_trained == 2 * 16
    assert (run / "policy.onnx").exists()


def test_one_report_holds_it_all(shown):
    page = (shown / "report.html").read_text(encoding="utf-8")
    titles = re.findall(r"<h2>(.*?)</h2>", page)
    assert titles == [
        "The walk",
        "In randomized worlds",
        "Through the deployment shim",
        "Learning on this machine",
        "Export of the new policy",
        "Provenance",
    ]
    assert page.count("data:video/mp4") == 1
    assert page.count("data:image/png") == 6
    assert "fingers demo --out" in page
    # Nothing is loaded from elsewhere.
    assert not re.findall(r'(?:src|href)="(?!data:|#)', page)


def test_without_a_policy_nothing_is_begun(tmp_path, capsys):
    out = tmp_path / "out"
    argv = ["demo", "--out", str(out), "--policy", str(tmp_path / "none")]
    assert main(argv) == 2
    assert "none" in capsys.readouterr().err
    assert not out.exists()


class Still:
    """Two worlds that hand back the action they were given."""

    num_envs, dt = 2, 0.02

    def step(self, state, action):
        return action


def test_exploration_noise_is_each_worlds_own_and_repeatable():
    keys = jax.random.split(jax.random.key(0), 2)

    def at(step):
        world = SimpleNamespace(key=keys, total_steps=jnp.full(2, step))
        state = SimpleNamespace(memory=SimpleNamespace(world=world))
        return np.asarray(Exploring(Still(), 0.5).step(state, jnp.ones((2, 2000))))

    drawn = at(3)
    assert np.abs(drawn.mean() - 1.0) < 0.05
    assert np.abs(drawn.std() - 0.5) < 0.05
    np.testing.assert_array_equal(drawn, at(3))
    assert np.abs(np.corrcoef(drawn[0], drawn[1])[0, 1]) < 0.1
    assert np.abs(np.corrcoef(drawn[0], at(4)[0])[0, 1]) < 0.1
