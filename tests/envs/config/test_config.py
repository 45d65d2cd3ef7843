import dataclasses
import math
import random
from dataclasses import dataclass, field
from typing import Literal

import pytest
from hypothesis import given, seed, settings
from hypothesis import strategies as st

from envs.config.typed import dump_yaml, from_dict, load_yaml, override, to_dict
from envs.errors import InputError

SEED = 20260101


@dataclass(frozen=True)
class Noise:
    std: float = field(default=0.1, metadata={"low": 0.0, "high": 2.0, "unit": "rad"})
    kind: Literal["normal", "uniform"] = "normal"


@dataclass(frozen=True)
class Config:
    delay_s: float = field(metadata={"unit": "s", "low": 0.0, "high": 0.2})
    steps: int = field(default=4, metadata={"low": 1})
    name: str = "crawl"
    shuffle: bool = False
    limit: float | None = None
    noise: Noise = Noise()
    sizes: tuple[int, ...] = (512, 256)
    box: tuple[float, float, float] = (0.1, 0.2, 0.3)
    weights: dict[str, float] = field(default_factory=lambda: {"lift": 6.25})
    extra: Noise | None = None
    scale: float | tuple[float, ...] | dict[str, float] = 1.0

    def __post_init__(self) -> None:
        if self.steps > 100 and self.shuffle:
            raise ValueError("at most 100 steps with shuffle")


def read(tmp_path, text: str | bytes) -> Config:
    path = tmp_path / "c.yaml"
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return load_yaml(Config, path)


def test_types_are_converted(tmp_path):
    text = "{delay_s: 1e-3, limit: 2, box: [1, 2.5, -3e+2], name: on, sizes: []}"
    config = read(tmp_path, text)
    assert config.delay_s == 0.001 and config.limit == 2.0
    assert type(config.limit) is float
    assert config.box == (1.0, 2.5, -300.0) and config.sizes == ()
    assert config.name == "on"
    assert read(tmp_path, "{delay_s: 0, steps: 012}").steps == 12


def test_json_is_accepted(tmp_path):
    assert read(tmp_path, '{"delay_s": 0.02, "limit": null}').limit is None


@pytest.mark.parametrize(
    ("text", "where", "valid"),
    [
        ("steps: 4", "delay_s", "a finite number >= 0 <= 0.2 [s]"),
        ("delay_s: fast", "delay_s", "a finite number"),
        ("delay_s: '1e-3'", "delay_s", "a finite number"),
        ("delay_s: 0.3", "delay_s", "<= 0.2"),
        ("delay_s: .nan", "delay_s", "a finite number"),
        ("{delay_s: 0, limit: -.inf}", "limit", "a finite number"),
        ("{delay_s: 0, limit: 1e999}", "limit", "a finite number"),
        ("{delay_s: true}", "delay_s", "a finite number"),
        ("{delay_s: 0, steps: 4.0}", "steps", "a whole number"),
        ("{delay_s: 0, steps: 0}", "steps", ">= 1"),
        ("{delay_s: 0, shuffle: yes}", "shuffle", "true or false"),
        ("{delay_s: 0, name: 3}", "name", "text"),
        ("{delay_s: 0, noize: {}}", "noize", "did you mean noise?"),
        ("{delay_s: 0, noise: {sdt: 1}}", "noise.sdt", "did you mean std?"),
        ("{delay_s: 0, noise: {std: 3}}", "noise.std", "<= 2 [rad]"),
        ("{delay_s: 0, noise: 3}", "noise", "a mapping of std, kind"),
        ("{delay_s: 0, noise: {kind: normla}}", "noise.kind", "did you mean normal?"),
        ("{delay_s: 0, box: [1, 2]}", "box", "a list of 3"),
        ("{delay_s: 0, box: [1, 2, x]}", "box.2", "a finite number"),
        ("{delay_s: 0, weights: {lift: a}}", "weights.lift", "a finite number"),
        ("{delay_s: 0, weights: [1]}", "weights", "a mapping"),
        ("{delay_s: 0, scale: {a: b}}", "scale.a", "a finite number"),
        ("{delay_s: 0, scale: true}", "scale", "a finite number"),
        ("{delay_s: 0, shuffle: true, steps: 101}", "", "at most 100 steps"),
        ("", "", "a mapping of delay_s"),
    ],
)
def test_a_mistake_names_its_field_and_what_fits(tmp_path, text, where, valid):
    with pytest.raises(InputError) as caught:
        read(tmp_path, text)
    assert caught.value.field == where
    assert valid in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "text",
    [
        "delay_s: 0.1\ndelay_s: 0.1",
        "{delay_s: 0.1, noise: {std: 1, std: 1}}",
        "delay_s: &a 0.1",
        "a: &a [x, x]\nb: &b [*a, *a]\nc: [*b, *b]",
        "delay_s: !!float 0.1",
        "delay_s: !!python/object/apply:os.system ['true']",
        "!x {delay_s: 0.1}",
        "delay_s: 0.1\n---\ndelay_s: 0.1",
        "[" * 100_000,
        "- " * 500,
        "{" * 500 + "}" * 500,
        "{delay_s: 0, limit: " + "9" * 5000 + "}",
        "{delay_s: 0, ? [a] : 1}",
        "{delay_s: 0, 3: 1}",
        "delay_s: 0.1 #" + "x" * (1 << 20),
        "delay_s: 0.1 \0",
        "\tdelay_s: 0.1",
        "delay_s: [",
        "delay_s: 0.1".encode("utf-16"),
        b"name: \xff",
    ],
)
def test_yaml_traps_are_refused(tmp_path, text):
    with pytest.raises(InputError) as caught:
        read(tmp_path, text)
    assert str(tmp_path) in str(caught.value)


@pytest.mark.parametrize("name", ["none.yaml", "", "x\0y"])
def test_unreadable_file(tmp_path, name):
    with pytest.raises(InputError):
        load_yaml(Config, str(tmp_path / name))


def test_override():
    config = Config(delay_s=0.02, extra=Noise(0.5))
    changed = override(
        config,
        ["noise.std=1e-3", "box.1=7", "weights.new=2", "extra=null", "sizes=[64]"],
    )
    assert changed.noise == Noise(0.001) and changed.box == (0.1, 7.0, 0.3)
    assert changed.weights == {"lift": 6.25, "new": 2.0}
    assert changed.extra is None and changed.sizes == (64,)
    assert config == Config(delay_s=0.02, extra=Noise(0.5))
    assert override(config, ["steps=1", "steps=2"]).steps == 2


@pytest.mark.parametrize(
    ("assignment", "message"),
    [
        ("steps", "field.subfield=value"),
        ("=3", "field.subfield=value"),
        ("stepz=3", "did you mean steps?"),
        ("noize.std=3", "did you mean noise?"),
        ("noise.sd=3", "did you mean std?"),
        ("steps.a=3", "no subfield"),
        ("extra.std=3", "no subfield"),
        ("box.3=3", "one of 0, 1, 2"),
        ("box.-1=3", "one of 0, 1, 2"),
        ("steps=", "a whole number"),
        ("steps=[", "strict YAML"),
        ("delay_s=1", "<= 0.2"),
        ("..=1", "one of"),
    ],
)
def test_override_refuses(assignment, message):
    with pytest.raises(InputError, match="--set") as caught:
        override(Config(delay_s=0.02), [assignment])
    assert message in str(caught.value)


texts = st.text(st.characters(codec="utf-8", exclude_categories=["Cs", "Cc"]))
finite = st.floats(allow_nan=False, allow_infinity=False)
noises = st.builds(
    Noise, std=st.floats(0, 2), kind=st.sampled_from(["normal", "uniform"])
)
configs = st.builds(
    Config,
    delay_s=st.floats(0, 0.2),
    steps=st.integers(1, 10**12),
    name=texts | st.sampled_from(["1e-3", "on", "null", "~", "012", "true", "*a", ""]),
    limit=st.none() | finite,
    noise=noises,
    sizes=st.lists(st.integers(), max_size=3).map(tuple),
    box=st.tuples(finite, finite, finite),
    weights=st.dictionaries(texts, finite, max_size=3),
    extra=st.none() | noises,
    scale=finite
    | st.lists(finite, max_size=3).map(tuple)
    | st.dictionaries(texts, finite, max_size=3),
)


@seed(SEED)
@settings(max_examples=200, deadline=None, database=None)
@given(configs)
def test_round_trip_is_the_identity(tmp_path_factory, config):
    path = tmp_path_factory.getbasetemp() / "round.yaml"
    path.write_text(dump_yaml(config), encoding="utf-8")
    assert load_yaml(Config, path) == config
    assert from_dict(Config, to_dict(config), "memory") == config


def test_round_trip_can_fail(tmp_path):
    """Negative control: the comparison above sees one changed digit."""
    config = Config(delay_s=0.1, box=(1 / 3, 0.0, 0.0))
    text = dump_yaml(config)
    assert read(tmp_path, text) == config
    assert read(tmp_path, text.replace("0.3333333333333333", "0.333333333")) != config


VALID = dump_yaml(Config(delay_s=0.019, extra=Noise(), limit=1.0, scale=(1.0, 2.0)))
SNIPPETS = [
    *["1e-3", ".nan", "-.inf", "on", "null", "~", "!!python/object:os.system x", "*a"],
    *["&a ", "<<: ", "{}", "[]", "[[", "}", ": ", "- ", "? ", "\t", "\n", "--- ", "'"],
    *["99999999999999999999", "0x1F", "1_000", "2020-01-01", "12:30:45", "é", "\0"],
]


def mutate(rng: random.Random, text: str) -> bytes:
    for _ in range(rng.randint(1, 2)):
        at, kind = rng.randrange(len(text) + 1), rng.randrange(5)
        end = min(len(text), at + rng.randint(1, 12))
        if kind == 0:
            text = text[:at] + rng.choice(SNIPPETS) + text[at:]
        elif kind == 1:
            text = text[:at] + text[end:]
        elif kind == 2:
            text = text[:at] + chr(rng.randrange(1, 0x250)) + text[at + 1 :]
        elif kind == 3:
            lines = text.split("\n")
            lines.insert(rng.randrange(len(lines)), rng.choice(lines))
            text = "\n".join(lines)
        else:
            text = text.replace(rng.choice(text.split() or ["x"]), rng.choice(SNIPPETS))
    content = bytearray(text.encode())
    if content and rng.random() < 0.1:
        content[rng.randrange(len(content))] ^= 1 << rng.randrange(8)
    return bytes(content)


def fuzz(tmp_path, count: int) -> tuple[int, int]:
    print(f"seed {SEED}")
    rng = random.Random(SEED)
    refused = accepted = 0
    for _ in range(count):
        try:
            config = read(tmp_path, mutate(rng, VALID))
        except InputError as error:
            assert "\n" not in str(error)
            refused += 1
        else:
            accepted += 1
            numbers = (config.delay_s, config.noise.std, *config.box)
            assert all(math.isfinite(number) for number in numbers)
            assert from_dict(Config, to_dict(config), "memory") == config
    return refused, accepted


def test_mutated_files_give_an_error_or_a_valid_configuration(tmp_path):
    refused, accepted = fuzz(tmp_path, 200)
    assert refused > 100 and accepted > 5


@pytest.mark.slow
def test_mutated_files_many(tmp_path):
    assert sum(fuzz(tmp_path, 1000)) == 1000


def test_plain_data_of_any_kind_gives_an_error_or_a_configuration():
    for data in (None, 3, "x", [], {1: 2}, {"delay_s": object()}, {"delay_s": {}}):
        with pytest.raises(InputError):
            from_dict(Config, data, "memory")


def test_to_dict_shares_nothing_mutable_with_the_object():
    config = Config(delay_s=0.1)
    to_dict(config)["weights"]["lift"] = 0.0
    assert config.weights == {"lift": 6.25}
    assert dataclasses.replace(config) == config
