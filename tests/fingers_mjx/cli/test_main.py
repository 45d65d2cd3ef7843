"""The commands as a user types them: train, resume, eval, export, play."""

import json

import imageio_ffmpeg
import numpy as np
import pytest
from support.cli_setup import make_run, make_setup

from envs.hand.hand_file import DEFAULT_HAND_FILE
from envs.hand.stance import load_stance
from fingers_mjx.cli.main import main
from fingers_mjx.demo.demo import POLICY_DIR
from fingers_mjx.evaluation.files import read_table
from fingers_mjx.policy.digest import digest
from fingers_mjx.policy.source import load_source
from fingers_mjx.runs import checkpoint
from fingers_mjx.runs.files import OutOfSpace
from fingers_mjx.runs.metrics import read_metrics
from fingers_mjx.training.errors import Diverged, Interrupted

TINY = [
    "num_envs=4",
    "iterations=2",
    "log_every=1",
    "checkpoint_every=1",
    "ppo.unroll_length=4",
    "ppo.epochs=1",
    "ppo.minibatches=2",
    "ppo.actor_layers=[16]",
    "ppo.critic_layers=[16]",
    "env.episode_s=2",
]
HEAVY_KG = 0.12
MEASURES = {
    "task_speed_mps",
    "five_finger_participation",
    "non_nail_participation",
    "mean_contact_tilt_deg",
    "worst_tip_planting_fraction",
    "survival",
    "path_speed_mps",
}


@pytest.fixture(scope="module")
def work(tmp_path_factory):
    return tmp_path_factory.mktemp("work")


@pytest.fixture(scope="module")
def run_dir(work):
    """A run with another hand than the default one."""
    path, hand = work / "run", work / "heavy.yaml"
    text = DEFAULT_HAND_FILE.read_text(encoding="utf-8")
    assert text.count("{value: 0.08,") == 1
    hand.write_text(text.replace("{value: 0.08,", f"{{value: {HEAVY_KG},"))
    argv = ["train", "crawl", "--preset", "cpu", "--seed", "5", "--out", str(path)]
    assert main([*argv, "--hand", str(hand), "--set", *TINY]) == 0
    return path


@pytest.fixture(scope="module")
def bundle_dir(run_dir, work):
    assert main(["eval", str(run_dir), "--episodes", "3", "--steps", "20"]) == 0
    assert main(["export", str(run_dir), "--out", str(work / "bundle")]) == 0
    return work / "bundle"


def test_a_run_directory_holds_what_it_is_rebuilt_from(run_dir):
    names = {p.name for p in run_dir.iterdir()}
    wanted = {"config.yaml", "hand.yaml", "run.json", "versions.json", "checkpoints"}
    assert wanted <= names
    source = load_source(run_dir)
    assert source.setup.train.seed == 5
    assert source.setup.train.ppo.actor_layers == (16,)
    assert source.setup.env.episode_s == 2.0
    assert source.steps_trained == 2 * 4 * 4


def test_resume_goes_on_and_may_go_further(run_dir, capsys):
    assert main(["train", "--resume", str(run_dir), "--set", "iterations=3"]) == 0
    done = [p.name for p in checkpoint.checkpoints(run_dir / "checkpoints")]
    assert done[-1] == "00000003"
    rows = read_metrics(run_dir / "metrics.jsonl")
    assert [row["iteration"] for row in rows] == [1, 2, 3]
    events = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert {"compiling", "progress", "checkpoint", "note"} <= {
        e["event"] for e in events
    }


def test_evaluation_of_a_run_is_kept_with_it(bundle_dir, run_dir):
    summary = json.loads((run_dir / "eval/summary.json").read_text())
    found = [summary[name] for name in ("task", "policy", "episodes", "seed")]
    assert found == ["crawl", "run", 3, 0]  # and not the way to it
    assert summary["steps_trained"] == load_source(run_dir).steps_trained
    checkpoint_of, bundle_of = (load_source(x).network for x in (run_dir, bundle_dir))
    assert summary["policy_sha256"] == digest(checkpoint_of) == digest(bundle_of)
    assert set(summary["measures"]) >= MEASURES
    for measure in summary["measures"].values():
        assert set(measure) >= {"mean", "std", "n"}
    table = read_table(run_dir / "eval/episodes.parquet")
    assert len(table["survival"]) == len(table["world/tip_friction"]) == 3
    pictures = {p.stem for p in (run_dir / "eval").glob("*.png")}
    assert pictures == {"gait", "feet", "tracking", "tracking_in_time"}


def test_a_bundle_stands_alone(bundle_dir, run_dir, work):
    names = {p.name for p in bundle_dir.iterdir()}
    assert names == {"policy.onnx", "manifest.json", "config.yaml", "hand.yaml"}
    manifest = json.loads((bundle_dir / "manifest.json").read_text())
    evaluation = manifest["provenance"]["evaluation"]
    assert "survival" in evaluation
    assert manifest["provenance"]["normalizer"]["steps"] == 48


def test_the_exported_policy_is_measured_as_the_run_is(bundle_dir, run_dir, work):
    """The same worlds and, up to rounding, the same episodes."""
    out, seed = work / "json", ["--episodes", "3", "--steps", "20", "--seed", "2"]
    found = []
    for source in (run_dir, bundle_dir / "policy.onnx"):
        path = out / f"{source.name}.json"
        assert main(["eval", str(source), *seed, "--json", str(path)]) == 0
        found.append(json.loads(path.read_text())["measures"])
    for name in ("task_speed_mps", "mean_contact_tilt_deg", "duration_s"):
        assert found[1][name]["mean"] == pytest.approx(found[0][name]["mean"], rel=1e-2)


def test_one_command_holds_for_every_episode(bundle_dir, tmp_path, capsys):
    path = tmp_path / "deep" / "forward.json"
    argv = ["eval", str(bundle_dir), "--episodes", "2", "--steps", "15", "--nominal"]
    argv += ["--command", "0.16", "0", "-0.1", "--json", str(path)]
    assert main(argv) == 0
    measures = json.loads(path.read_text())["measures"]
    assert measures["command_speed_mps"]["mean"] == pytest.approx(0.16)
    assert measures["command_speed_mps"]["std"] < 1e-6
    assert measures["command_turn_rate_rad_s"]["mean"] == pytest.approx(-0.1)
    said = capsys.readouterr()
    assert "task_speed_mps" in said.out
    assert "Failed to import" not in said.out
    assert all(json.loads(line) for line in said.err.splitlines())


def test_a_run_plays_without_an_export_before_it(run_dir, capsys):
    assert not (run_dir / "policy.onnx").exists()
    before = {p.name for p in run_dir.iterdir()}
    argv = ["play", str(run_dir), "--seconds", "0.2", "--env.episode-s", "1"]
    assert main(argv) == 0, capsys.readouterr().err
    assert "task_speed_mps" in capsys.readouterr().out
    assert {p.name for p in run_dir.iterdir()} == before


def test_play_writes_video_and_summary(bundle_dir, tmp_path, capsys):
    video, path = tmp_path / "walk.mp4", tmp_path / "play.json"
    argv = ["play", str(bundle_dir), "--seconds", "0.2", "--width", "96"]
    argv += ["--video", str(video), "--fps", "20", "--json", str(path)]
    argv += ["--command", "0.16", "0", "0", "--command", "0", "0.1", "0"]
    assert main(argv) == 0
    summary = json.loads(path.read_text())
    assert summary["measures"]["command_speed_mps"]["mean"] == pytest.approx(0.13)
    assert summary["conditions"]["commands"] == [[0.16, 0, 0], [0, 0.1, 0]]
    reader = imageio_ffmpeg.read_frames(str(video))
    meta = next(reader)
    pictures = [np.frombuffer(frame, np.uint8) for frame in reader]
    assert meta["size"] == (96, 54)
    assert len(pictures) == 4
    assert pictures[0].std() > 10
    assert np.abs(pictures[0].astype(int) - pictures[-1]).max() > 5
    assert "path_speed_mps" in capsys.readouterr().out


def test_play_draws_the_worlds_of_the_evaluation(tmp_path):
    """Same seed, same worlds, same steps: the sim-to-sim check compares like with like.

    Over so few steps that the last bits, which contacts magnify, do not count yet; a
    step more or less, or a first step of another kind, shows.
    """
    paths = [tmp_path / f"{name}.json" for name in ("eval", "play")]
    common = [str(POLICY_DIR), "--episodes", "3", "--seed", "4", "--json"]
    assert main(["eval", *common, str(paths[0]), "--steps", "20"]) == 0
    argv = ["play", *common, str(paths[1]), "--seconds", "0.4", "--randomize"]
    assert main(argv) == 0
    ours, theirs = (json.loads(p.read_text())["measures"] for p in paths)
    assert ours["duration_s"]["mean"] == pytest.approx(0.4)
    for name in ("command_speed_mps", "command_turn_rate_rad_s", "duration_s"):
        assert theirs[name]["mean"] == pytest.approx(ours[name]["mean"], rel=1e-6)
    for name in ("task_speed_mps", "mean_contact_tilt_deg", "energy_j"):
        assert theirs[name]["mean"] == pytest.approx(ours[name]["mean"], rel=1e-3)


@pytest.mark.slow
def test_warm_start_takes_the_networks(run_dir, tmp_path):
    path = tmp_path / "next"
    argv = ["train", "crawl", "--warm-start", str(run_dir), "--out", str(path)]
    few = [text for text in TINY if not text.startswith("iterations")]
    fixed = ["iterations=1", "ppo.learning_rate=1e-9", "ppo.learning_rate_min=1e-9"]
    assert main([*argv, "--set", *few, *fixed]) == 0
    ours, theirs = load_source(path).network, load_source(run_dir).network
    for (one, _), (two, _) in zip(ours.layers, theirs.layers, strict=True):
        np.testing.assert_allclose(one, two, atol=1e-5)


def test_warm_start_from_other_networks_is_refused(run_dir, tmp_path, capsys):
    path = tmp_path / "next"
    argv = ["train", "crawl", "--warm-start", str(run_dir), "--out", str(path)]
    assert main([*argv, "--set", *TINY, "ppo.actor_layers=[8]"]) == 2
    said = capsys.readouterr().err
    assert "policy/params" in said
    assert "[8,20]" in said
    assert not path.exists()


ENDS = [
    (Diverged("loss/value", 3, 4, "dump.npz", None), 3),
    (OutOfSpace("checkpoint", 10, 5), 4),
    (Interrupted("checkpoints/00000001", 1), 75),
    (OSError(28, "No space left on device", "x"), 4),
    (PermissionError(13, "Permission denied", "x"), 2),
    (KeyboardInterrupt(), 130),
]


@pytest.mark.parametrize(("error", "status"), ENDS, ids=lambda x: type(x).__name__)
def test_exit_status_says_how_it_ended(monkeypatch, tmp_path, capsys, error, status):
    def end(args):
        raise error

    monkeypatch.setattr("fingers_mjx.cli.train.run", end)
    assert main(["train", "crawl", "--out", str(tmp_path / "run")]) == status
    said = capsys.readouterr().err
    assert said.startswith("fingers: ")
    assert said.count("\n") == 1


def test_a_fault_of_ours_is_not_hidden(monkeypatch):
    def fail(args):
        raise ZeroDivisionError

    monkeypatch.setattr("fingers_mjx.cli.train.run", fail)
    with pytest.raises(ZeroDivisionError):
        main(["train", "crawl"])


def test_a_missing_extra_is_named(monkeypatch, capsys):
    def fail(args):
        raise ModuleNotFoundError("No module named 'matplotlib'", name="matplotlib")

    monkeypatch.setattr("fingers_mjx.cli.train.run", fail)
    assert main(["train", "crawl"]) == 2
    assert "sync --inexact --extra viz\n" in capsys.readouterr().err


def test_a_run_that_was_never_trained_can_be_exported(tmp_path):
    """Networks of any checkpoint; nothing of the evaluation is claimed."""
    run = make_run(tmp_path / "run", make_setup())
    assert main(["export", str(run)]) == 0
    manifest = json.loads((run / "manifest.json").read_text())
    assert manifest["provenance"]["evaluation"] is None


def test_another_hand_is_kept_and_used(run_dir, bundle_dir):
    """The heavier hand of the run, which settles deeper than the default one."""
    assert load_source(run_dir).setup.hand.payload_mass.value == HEAVY_KG
    manifest = json.loads((bundle_dir / "manifest.json").read_text())
    ours = np.array(manifest["interface"]["reference_angles_rad"])
    assert 1e-4 < np.abs(ours - load_stance().joint_pos_rad).max() < 0.2
