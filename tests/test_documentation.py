"""What the documents say can be typed, clicked and run."""

import doctest
import itertools
import re
import runpy
import shlex
from pathlib import Path

import pytest
import yaml

from envs import registry
from envs.errors import InputError
from fingers_mjx.cli.main import UsageError, make_parser

ROOT = Path(__file__).parents[1]
DOCUMENTS = sorted(
    [*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md"), ROOT / "deploy/README.md"]
)
PLACES = re.compile(r"/(work|tmp|home|root)/|localhost", re.IGNORECASE)


def commands(text):
    """Yields the lines of shell blocks, without comments."""
    for block in re.findall(r"```sh\n(.*?)```", text, re.DOTALL):
        for line in block.splitlines():
            if words := shlex.split(line, comments=True):
                yield words


def module_path(module):
    """Modules are run by name, so that a file never stands in for a library."""
    path = module.replace(".", "/")
    return path + "/__main__.py" if (ROOT / path).is_dir() else path + ".py"


def name(path):
    return str(path.relative_to(ROOT))


def test_examples_of_the_readme_give_what_they_say():
    result = doctest.testfile(str(ROOT / "README.md"), module_relative=False)
    assert result.attempted >= 4
    assert result.failed == 0


CONTRIBUTING = re.findall(
    r"^## (Add .*?)\n.*?```python\n(.*?)```",
    (ROOT / "CONTRIBUTING.md").read_text("utf-8"),
    re.MULTILINE | re.DOTALL,
)


@pytest.mark.parametrize(("what", "program"), CONTRIBUTING, ids=lambda x: x[:20])
def test_examples_of_contributing_run(tmp_path, monkeypatch, what, program):
    (tmp_path / "example.py").write_text(program, "utf-8")
    # What an example registers is not there for the tests after it.
    monkeypatch.setattr(registry, "_TASKS", dict(registry._TASKS))
    assert runpy.run_path(str(tmp_path / "example.py")), what


def test_there_is_an_example_of_everything_that_can_be_added():
    added = [what.split(" of ")[0].split()[-1] for what, _ in CONTRIBUTING]
    assert added == ["reward", "task", "effect", "driver"]


@pytest.mark.parametrize("path", DOCUMENTS, ids=name)
def test_links_lead_somewhere(path):
    targets = re.findall(r"\]\(([^)#]+)[^)]*\)", path.read_text("utf-8"))
    local = [t for t in targets if "://" not in t]
    assert [t for t in local if not (path.parent / t).exists()] == []


@pytest.mark.parametrize("path", DOCUMENTS, ids=name)
def test_commands_exist(path):
    parser, makefile = make_parser(), (ROOT / "Makefile").read_text("utf-8")
    for words in commands(path.read_text("utf-8")):
        if words[0] == "fingers":
            parser.parse_args(words[1:])
        elif words[0] == "make":
            assert re.search(rf"^{words[1]}:", makefile, re.MULTILINE), words
        elif words[0] == "python":
            assert words[1] == "-m" and (ROOT / module_path(words[2])).exists(), words


def test_wrong_commands_would_be_seen():
    """Negative control."""
    assert list(commands("```sh\nfingers train --no-such x  # why\n```")) == [
        ["fingers", "train", "--no-such", "x"]
    ]
    with pytest.raises((UsageError, InputError)):
        make_parser().parse_args(["train", "--no-such", "x"])


EXAMPLES = sorted(ROOT.glob("examples/*/README.md"))


def files(text):
    """Yields the files that commands of a text read and none before them wrote."""
    made = set()
    for words in commands(text):
        for before, word in itertools.pairwise(words):
            if before in ("--out", "-o", "--json"):
                made.add(Path(word))
            elif "://" in word:  # git clone
                made.add(Path(word.rsplit("/", 1)[1]))
            elif not re.fullmatch(r"[^-=][^=]*(/|\.[a-z])[^=]*", word):
                continue
            elif made.isdisjoint([Path(word), *Path(word).parents]):
                yield word


@pytest.mark.parametrize("path", EXAMPLES, ids=name)
def test_files_in_the_commands_of_an_example_are_there(path):
    found = list(files(path.read_text("utf-8")))
    assert found and [file for file in found if not (ROOT / file).exists()] == []


def test_a_file_that_nothing_made_would_be_seen():
    """Negative control."""
    text = (
        "```sh\nfingers x a.yaml --a.b 0.5 --set c.d=1 -o runs\nfingers y runs/z a\n```"
    )
    assert list(files(text)) == ["a.yaml"]


@pytest.mark.parametrize("path", DOCUMENTS, ids=name)
def test_documents_name_no_place_of_one_machine(path):
    assert PLACES.search(path.read_text("utf-8")) is None


def test_settings_in_the_training_guide_exist():
    from fingers_mjx.ppo.config import TrainConfig
    from fingers_mjx.runs.setup import new_setup, overridden

    text = (ROOT / "docs/guides/training.md").read_text("utf-8")
    found = [
        overridden(new_setup(TrainConfig(), None), given.split())
        for given in re.findall(r"`--set ([^`]+)`", text)
    ]
    assert len(found) == 2
    assert found[0].train.num_envs == 2048 and found[0].env.curriculum_scale == 0.25
    assert found[1].train.ppo.critic_iterations == 100


def test_presets_in_the_training_guide_are_those_of_the_code():
    from fingers_mjx.ppo.config import PRESETS

    text = (ROOT / "docs/guides/training.md").read_text("utf-8")
    rows = re.findall(
        r"^\| `(\w+)` \|[^|]*\| ([\d,]+) \| ([\d,]+) \|", text, re.MULTILINE
    )
    said = {name: (worlds, iterations) for name, worlds, iterations in rows}
    made = {name: make() for name, make in PRESETS.items()}
    assert said == {
        name: (f"{m.num_envs:,}", f"{m.iterations:,}") for name, m in made.items()
    }


PAPER = (ROOT / "docs/reference/paper.md").read_text("utf-8").split("\n## ")
NOT_THE_PAPERS = {"env.weights", "env.contacts_per_world", "env.constraints_per_world"}
"""Settings of which the page of the paper's values does not speak."""


def beside_the_paper(task):
    """Rows (setting, paper, ours, why) of the page, and our settings by dotted name."""
    from envs.config.typed import to_dict
    from fingers_mjx.ppo.config import preset
    from fingers_mjx.runs.setup import new_setup

    texts = [text for text in PAPER if f"`{task}`" in text.partition("\n")[0]]
    rows = re.findall(
        r"^\| `([\w.]+)` \| ([^|]+) \| ([^|]+) \| ?([^|]*)\|$",
        "\n".join(texts),
        re.MULTILINE,
    )
    setup = new_setup(preset("paper", task), None)
    return rows, flat(to_dict(setup.train) | {"env": to_dict(setup.env)})


def flat(tree, prefix=""):
    if not isinstance(tree, dict) or prefix == "env.weights.":
        return {prefix.rstrip("."): tree}
    leaves = [flat(x, f"{prefix}{name}.") for name, x in tree.items()]
    return {k: v for inner in leaves for k, v in inner.items()}


@pytest.mark.parametrize("task", ["crawl", "recovery", "keyboard", "push"])
def test_values_beside_the_papers_are_those_of_the_code(task):
    rows, ours = beside_the_paper(task)
    assert len(rows) >= 3
    said = {name: yaml.safe_load(value) for name, _, value, _ in rows}
    # YAML 1.1 reads 1e-3 as text.
    said = {k: float(v) if isinstance(ours[k], float) else v for k, v in said.items()}
    assert said == {name: ours[name] for name in said}
    # Where the paper states a value, ours is that value.
    assert [(name, a, b) for name, a, b, _ in rows if a not in ("–", b)] == []


def test_every_setting_stands_beside_the_papers():
    rows, ours = beside_the_paper("crawl")
    wanted = {name for name in ours if name.startswith(("ppo.", "env."))}
    assert wanted - {row[0] for row in rows} == NOT_THE_PAPERS


@pytest.mark.parametrize(
    ("page", "table"),
    [
        ("crawl.md", "CRAWL"),
        ("recovery.md", "RECOVERY"),
        ("keyboard.md", "KEYBOARD"),
        ("push.md", "PUSH"),
    ],
)
def test_rewards_in_the_reference_are_those_of_the_code(page, table):
    import rewards

    text = (ROOT / "docs" / "reference" / page).read_text("utf-8")
    rows = re.findall(r"^\| (`[\w`, ]+`) \| (?:[−\d]|as crawl)", text, re.MULTILINE)
    names = [name for row in rows for name in re.findall(r"\w+", row)]
    assert sorted(names) == sorted(row.name for row in getattr(rewards, table))


SWEEPS = [
    text
    for page in ("guides/studies.md", "reference/paper.md")
    for text in re.findall(
        r"```yaml\n(task:.*?)```", (ROOT / "docs" / page).read_text("utf-8"), re.DOTALL
    )
]


@pytest.mark.usefixtures("every_backend")
@pytest.mark.parametrize("text", SWEEPS, ids=range(len(SWEEPS)))
def test_sweeps_in_the_documents_can_begin(tmp_path, text):
    from envs.config.typed import load_yaml
    from fingers_mjx.studies.sweep.resolve import keep_sweep
    from fingers_mjx.studies.sweep.spec import Sweep

    source = tmp_path / "spec.yaml"
    source.write_text(text, "utf-8")
    (tmp_path / "sweep").mkdir()
    spec = load_yaml(Sweep, source)
    made = keep_sweep(spec, source, tmp_path / "sweep")
    assert len(SWEEPS) == 4 and made.configurations
