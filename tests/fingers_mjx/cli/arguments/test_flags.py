"""Settings as flags: the same as `--set`, listed with all that is known of them."""

import re
from argparse import Namespace

import pytest

from envs.config.documented import settings_of
from envs.errors import InputError
from envs.registry import get_task, task_names
from fingers_mjx.cli.arguments.completion import SCRIPTS, candidates
from fingers_mjx.cli.arguments.flags import _shown, assignments, divided
from fingers_mjx.cli.main import main, make_parser
from fingers_mjx.ppo.config import TrainConfig, preset
from fingers_mjx.runs.settings import load_settings
from fingers_mjx.studies.sweep.spec import Sweep

POLICY = "fingers_mjx/policies/crawl"
UNITS = {"_s": "s", "_m": "m", "_rad": "rad", "_deg": "deg", "_mps": "m/s", "_hz": "Hz"}


def offered(task="crawl"):
    yield from settings_of(preset("cpu", task))
    yield from settings_of(get_task(task).config(), "env.")


@pytest.fixture
def help_of_crawl(capsys):
    """The help of the settings, on one line without its boxes."""
    with pytest.raises(SystemExit):
        main(["train", "crawl", "--help"])
    return " ".join(capsys.readouterr().out.replace("│", " ").split())


@pytest.mark.parametrize(
    "config", [TrainConfig(), Sweep("crawl")], ids=["run", "sweep"]
)
def test_every_setting_says_what_it_is(config):
    assert [s.name for s in settings_of(config) if not s.doc] == []


@pytest.mark.parametrize("task", task_names())
def test_no_two_settings_of_a_task_say_the_same(task):
    docs = [s.doc for s in settings_of(get_task(task).config())]
    assert sorted(set(docs)) == sorted(docs)


@pytest.mark.parametrize("task", task_names())
def test_every_setting_of_a_task_says_what_it_is_and_its_unit(task):
    found = list(settings_of(get_task(task).config()))
    assert [s.name for s in found if not s.doc] == []
    for end, unit in UNITS.items():
        named = [s for s in found if s.name.endswith(end)]
        assert [s.name for s in named if s.meta.get("unit") != unit] == []


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["--iterations", "3"], ["iterations=3"]),
        (["--iterations=3"], ["iterations=3"]),
        (["--ppo.learning_rate", "1e-3"], ["ppo.learning_rate=1e-3"]),
        (
            ["--env.command.vel-y-mps", "-0.1", ".1"],
            ["env.command.vel_y_mps=[-0.1, .1]"],
        ),
        (["--ppo.actor-layers", "8"], ["ppo.actor_layers=[8]"]),
        (
            ["--env.weights", "lift=3", "footprint=-20"],
            ["env.weights.lift=3", "env.weights.footprint=-20"],
        ),
        (["--on-overflow", "warn"], ["on_overflow=warn"]),
    ],
)
def test_flags_are_assignments(words, expected):
    assert assignments(offered(), words) == expected


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--env.comand.vel-y-mps", "0", "1"], "did you mean --env.command.vel-y-mps?"),
        (["--iterations", "3", "4"], "--iterations: found 3 4; valid: a whole number"),
        (["--env.episode-s"], "--env.episode-s: found nothing"),
        (["--sed", "3"], "did you mean --seed?"),
    ],
)
def test_wrong_flags_are_one_sentence(words, said):
    with pytest.raises(InputError, match=re.escape(said)) as caught:
        assignments(offered(), words)
    assert len(str(caught.value)) <= 300 and "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "rest", "flags"),
    [
        ("crawl --iterations 3 --out x", "crawl --out x", "--iterations 3"),
        ("--iterations 3 crawl", "crawl", "--iterations 3"),
        ("--iterations=3 4 crawl", "4 crawl", "--iterations=3"),
        ("crawl --a.b -1 2 -v", "crawl -v", "--a.b -1 2"),
        ("--w lift=1 foot=2 crawl", "crawl", "--w lift=1 foot=2"),
    ],
)
def test_words_of_the_command_stay_with_it(text, rest, flags):
    assert divided(text.split(), ["--out"]) == (rest.split(), flags.split())


@pytest.mark.parametrize(
    ("flag", "shown"),
    [
        ("--on-overflow {stop,warn}", "stop"),
        ("--loggers {wandb,rerun}...", "none"),
        ("--env.weights NAME=VALUE...", "none"),
        ("--ppo.actor-layers INT...", "256 128"),
        ("--spread-ends {true,false}", "false"),
        ("--ppo.learning-rate-min FLOAT", "1e-05"),
        ("--env.rewards TEXT", "footprint"),
    ],
)
def test_defaults_are_shown_as_they_would_be_typed(flag, shown, help_of_crawl):
    _, _, behind = help_of_crawl.partition(flag)
    default = behind.partition("(default: ")[2].partition(")")[0]
    assert behind and default == shown


def test_a_mapping_and_an_absent_value_are_shown_in_words():
    found = settings_of(
        Sweep("crawl", set={"ppo.actor_layers": (16,), "iterations": 3})
    )
    shown = {s.name: _shown(s.default) for s in found if s.name in ("set", "hand")}
    assert shown["set"] == ("ppo.actor_layers=[16]", "iterations=3")
    assert shown["hand"] == ("none",)


def test_ranges_are_whole_numbers_where_they_are_whole(help_of_crawl):
    assert ">= 1 <= 1048576." in help_of_crawl and "e+0" not in help_of_crawl


def test_a_dry_run_prints_what_reads_back(tmp_path, capsys):
    words = ["--env.command.straight-fraction", "0.2", "--iterations", "3"]
    argv = ["train", "crawl", "--preset", "fast", "--set", "ppo.clip=0.3", "--dry-run"]
    assert main([*argv, *words, "--out", str(tmp_path / "run")]) == 0
    file = tmp_path / "config.yaml"
    file.write_text(capsys.readouterr().out, "utf-8")
    found = load_settings(file, "crawl")
    assert (found.train.preset, found.train.iterations) == ("fast", 3)
    assert (found.train.ppo.clip, found.env.command.straight_fraction) == (0.3, 0.2)
    assert not (tmp_path / "run").exists()


def test_a_dry_run_of_a_sweep_takes_flags(tmp_path, capsys):
    spec = tmp_path / "spec.yaml"
    spec.write_text("task: crawl\nset: {iterations: 2}\n", "utf-8")
    assert main(["sweep", str(spec), "--seeds", "5", "--dry-run"]) == 0
    said = capsys.readouterr().out
    assert "seeds: 5" in said and "iterations: 2" in said


@pytest.mark.parametrize("command", ["eval", "play"])
def test_a_policy_offers_the_settings_of_its_task(command, capsys):
    assert main([command, POLICY, "--env.episod-s", "3"]) == 2
    assert "did you mean --env.episode-s?" in capsys.readouterr().err
    with pytest.raises(SystemExit) as done:
        main([command, POLICY, "--help"])
    said = " ".join(capsys.readouterr().out.replace("│", " ").split())
    assert done.value.code == 0
    assert re.search(r"--env.episode-s FLOAT episode length .*? \[s\].*?20\.0", said)


@pytest.mark.parametrize("command", ["train", "eval", "play", "sweep"])
def test_help_without_the_argument_says_how_to_list_the_settings(command, capsys):
    with pytest.raises(SystemExit):
        main([command, "--help"])
    said = " ".join(capsys.readouterr().out.split())
    assert "--env." not in said
    assert re.search(r"--help after (it|POLICY) lists", said)


@pytest.mark.parametrize(
    ("words", "found"),
    [
        (["tr"], ["train"]),
        (["train", "cr"], ["crawl"]),
        (["train", "crawl", "--preset", ""], sorted(["paper", "adapt", "fast", "cpu"])),
        (
            ["train", "push", "--env.target-"],
            ["--env.target-bearing-deg", "--env.target-m"],
        ),
        (["train", "crawl", "--env.target-m"], []),
        (["eval", POLICY, "--env.episode"], ["--env.episode-s"]),
        (["sysid", "inf"], ["info"]),
        (["train", "crawl", "--out", "x"], []),
    ],
)
def test_words_are_completed(words, found):
    assert candidates(make_parser(), words) == found


def test_the_script_of_a_shell_is_printed(capsys):
    with pytest.raises(SystemExit):
        main(["--print-completion", "bash"])
    assert capsys.readouterr().out == SCRIPTS["bash"]
    assert isinstance(make_parser().parse_args(["train", "crawl"]), Namespace)
