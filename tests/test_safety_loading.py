"""Damaged files are refused in one sentence and run nothing (F5, X3).

Files of every kind, as the commands write them, are loaded sound and damaged under the
eyes of the suite's watch.
"""

import random
import shutil
import time
from pathlib import Path

import numpy as np
import pytest
from support import cli_setup

from envs.config.typed import dump_yaml, load_yaml, to_dict
from envs.errors import InputError
from envs.hand.hand_file import DEFAULT_HAND_FILE, load_hand_file
from envs.hand.importing.load import load_custom_hand
from envs.hand.model import build_spec
from envs.tasks.crawl import CrawlConfig
from fingers_deploy import BundleError, load_bundle
from fingers_mjx.evaluation.files import read_table, write_table
from fingers_mjx.policy.source import load_source
from fingers_mjx.runs import checkpoint
from fingers_mjx.runs.metrics import read_metrics
from fingers_mjx.runs.setup import run_setup

SEED = 20260119


@pytest.fixture(autouse=True)
def nothing_is_run(watch):
    yield
    assert watch.unsafe == []


SNIPPETS = [
    *["1e-3", ".nan", "-.inf", "1e999", "on", "null", "~", "-1", "[]", "{}", "9" * 400],
    *[
        "!!python/object/apply:os.system ['true']",
        "!!python/name:os.system",
        "&a ",
        "*a",
    ],
    *["<<: *a", "? ", ": ", "- ", "\t", "\n", "--- ", "'", '"', "#", "\0", "é", "unit"],
]


def mutated(rng, text):
    """A file with one or two faults, as bytes."""
    for _ in range(rng.randint(1, 2)):
        at, kind = rng.randrange(len(text) + 1), rng.randrange(6)
        if kind == 0:
            text = text[:at] + rng.choice(SNIPPETS) + text[at:]
        elif kind == 1:
            text = text[:at] + text[at + rng.randint(1, 20) :]
        elif kind == 2:
            text = text[:at]
        elif kind == 3:
            lines = text.split("\n")
            lines.insert(rng.randrange(len(lines)), rng.choice(lines))
            text = "\n".join(lines)
        else:
            word = rng.choice(text.split() or ["x"])
            text = text.replace(word, rng.choice(SNIPPETS), 1)
    content = bytearray(text.encode())
    if content and rng.random() < 0.2:
        content[rng.randrange(len(content))] ^= 1 << rng.randrange(8)
    return bytes(content)


def fuzz(path, text, load, count):
    """Loads damaged copies; returns how many were refused."""
    print(f"seed {SEED}")
    rng, refused = random.Random(SEED), 0
    for _ in range(count):
        path.write_bytes(mutated(rng, text))
        start = time.process_time()
        try:
            value = load(path)
        except InputError as error:
            refused += 1
            assert str(path) in str(error) and "\n" not in str(error)
        else:  # what is accepted is complete and sound: it can be written again
            path.write_text(dump_yaml(value), encoding="utf-8")
            assert to_dict(load(path)) == to_dict(value)
        assert time.process_time() - start < 10
    return refused


COUNTS = pytest.mark.parametrize(
    "count", [100, pytest.param(1000, marks=pytest.mark.slow)]
)


@COUNTS
def test_damaged_hand_files(tmp_path, count):
    text = DEFAULT_HAND_FILE.read_text("utf-8")
    assert fuzz(tmp_path / "hand.yaml", text, load_hand_file, count) > 0.5 * count


@pytest.mark.parametrize("count", [200, pytest.param(1000, marks=pytest.mark.slow)])
def test_damaged_settings(tmp_path, count):
    """Some faults leave sound settings: few enough that 100 may have none of them."""
    text = dump_yaml(CrawlConfig(weights={"lift": 3.0}))
    path = tmp_path / "config.yaml"
    refused = fuzz(path, text, lambda p: load_yaml(CrawlConfig, p), count)
    assert 0.5 * count < refused < count


@pytest.fixture(scope="module")
def artefacts(tmp_path_factory):
    """One file or directory of each kind, as the commands write them."""
    root = tmp_path_factory.mktemp("artefacts")
    setup = cli_setup.make_setup()
    cli_setup.make_bundle(root / "bundle", setup)
    cli_setup.make_run(root / "run", setup)
    write_table(root / "episodes.parquet", {"survival": np.ones(3)})
    (root / "metrics.jsonl").write_text('{"iteration": 1, "kl": 0.1}\n')
    spec = build_spec(setup.hand)
    spec.compile()
    (root / "hand.xml").write_text(spec.to_xml())
    return root


def newest(path):
    return checkpoint.load(checkpoint.newest(path / "checkpoints", lambda _: None))


KINDS = {
    "bundle/policy.onnx": (load_bundle, "bundle"),
    "bundle/manifest.json": (load_bundle, "bundle"),
    "bundle/config.yaml": (load_source, "bundle"),
    "bundle/hand.yaml": (load_source, "bundle"),
    "run/config.yaml": (run_setup, "run"),
    "run/hand.yaml": (run_setup, "run"),
    "run/checkpoints/**/*": (newest, "run"),
    "episodes.parquet": (read_table, "episodes.parquet"),
    "hand.xml": (load_custom_hand, "hand.xml"),
}


@pytest.mark.parametrize("name", KINDS)
def test_a_sound_file_runs_nothing(artefacts, name):
    load, target = KINDS[name]
    load(artefacts / target)
    assert list(artefacts.glob(name))


@pytest.mark.parametrize("damage", ["half", "empty", "zeros", "text", "pickle"])
@pytest.mark.parametrize("name", KINDS)
def test_a_damaged_file_is_refused_in_one_sentence(artefacts, tmp_path, name, damage):
    load, target = KINDS[name]
    copy = tmp_path / "copy"
    shutil.copytree(artefacts, copy)
    for path in filter(Path.is_file, copy.glob(name)):
        content = path.read_bytes()
        spoiled = {
            "half": content[: len(content) // 2],
            "empty": b"",
            "zeros": bytes(len(content)),
            "text": b"{{{ not this",
            # pickle of os.system("true"), protocol 0
            "pickle": b"cos\nsystem\n(S'true'\ntR.",
        }
        path.write_bytes(spoiled[damage])
    with pytest.raises((InputError, BundleError)) as caught:
        load(copy / target)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("damage", [b"", b"{", b"[1]\n", b"\xff\n", b"cos\nsystem\n."])
def test_a_damaged_curve_is_read_as_far_as_it_goes_or_refused(tmp_path, damage):
    """The last line may be cut off by a kill; what comes before it is kept."""
    path = tmp_path / "metrics.jsonl"
    path.write_bytes(b'{"iteration": 1, "kl": 0.1}\n' + damage)
    try:
        rows = read_metrics(path)
    except InputError as error:
        assert "\n" not in str(error)
    else:
        assert rows[0]["kl"] == 0.1
