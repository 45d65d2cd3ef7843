import copy
import dataclasses
import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fingers_deploy import BundleError
from fingers_deploy.checks import parse_manifest
from fingers_deploy.manifest import Manifest, dump_manifest

FLOAT32 = st.floats(width=32, allow_nan=False, allow_infinity=False)
DELETE = object()


@pytest.fixture(scope="module")
def table(bundle):
    return json.loads(dump_manifest(bundle.manifest))


def _edit(table, path, value):
    edited = copy.deepcopy(table)
    *parents, last = path
    place = edited
    for key in parents:
        place = place[key]
    if value is DELETE:
        del place[last]
    else:
        place[last] = value
    return json.dumps(edited)


def _leaves(value, path=()):
    """Paths of every field, the first entry standing for the others of a list."""
    if path:
        yield path
    items = value.items() if isinstance(value, dict) else enumerate(value[:1])
    for key, child in items:
        if isinstance(child, dict | list):
            yield from _leaves(child, (*path, key))
        else:
            yield (*path, key)


def _refusal(text):
    with pytest.raises(BundleError) as caught:
        parse_manifest(text, "manifest.json")
    sentence = str(caught.value)
    assert sentence.startswith("manifest.json")
    assert "found" in sentence and "valid" in sentence and "\n" not in sentence
    return caught.value


def test_round_trip_is_the_identity(bundle):
    text = dump_manifest(bundle.manifest)
    assert parse_manifest(text, "manifest.json") == bundle.manifest
    assert dump_manifest(parse_manifest(text, "manifest.json")) == text


@settings(max_examples=2000, deadline=None)
@given(obs=st.lists(FLOAT32, min_size=3, max_size=3), scale=FLOAT32)
def test_numbers_survive_to_the_bit(obs, scale):
    text = dump_manifest(_Numbers(tuple(obs), scale))
    read = json.loads(text)
    written = np.asarray([*obs, scale], np.float32)
    assert np.asarray([*read["obs"], read["scale"]], np.float32).tobytes() == (
        written.tobytes()
    )


@dataclasses.dataclass(frozen=True)
class _Numbers:
    obs: tuple[float, ...]
    scale: float


def test_every_field_is_required_and_typed(table):
    wrong = ("text", True, None, [[]], {"a": True}, -1e39)
    for path in _leaves(table):
        free = path[:2] in {("provenance", "versions"), ("provenance", "evaluation")}
        if isinstance(path[-1], str) and not (free and len(path) == 3):
            assert path[-1] in _refusal(_edit(table, path, DELETE)).field
        refused = 0
        for value in wrong:
            try:
                parse_manifest(_edit(table, path, value), "manifest.json")
            except BundleError as error:
                refused += 1
                assert str(path[0]) in error.field
        # "text" is right for free texts, null for optional fields, not both.
        assert refused >= len(wrong) - 1, path


def test_unknown_keys_are_refused_everywhere(table):
    places = [()] + [p for p in _leaves(table) if isinstance(_at(table, p), dict)]
    free = {("provenance", "versions"), ("provenance", "evaluation")}
    for place in places:
        if place not in free:
            error = _refusal(_edit(table, (*place, "extra"), 1))
            assert error.field.endswith("extra")
    assert len(places) > 8


def _at(table, path):
    for key in path:
        table = table[key]
    return table


I = "interface"  # noqa: E741
MALFORMED = [
    (("schema_version",), 2),
    (("schema_version",), True),
    (("task",), "../crawl"),
    (("task",), "crawl\n"),
    (("policy", "input"), "observation"),
    (("policy", "output"), "/etc/passwd"),
    (("policy", "obs_size"), 391),
    (("policy", "obs_size"), 392.0),
    (("policy", "action_size"), 19),
    (("policy", "sha256"), "0" * 63),
    (("policy", "sha256"), "G" * 64),
    ((I, "joint_names"), ["finger1_joint1"] * 20),
    ((I, "joint_names"), []),
    ((I, "joint_names", 3), "a" * 4096),
    ((I, "joint_names", 3), "../joint"),
    ((I, "joint_names", 3), "~root"),
    ((I, "joint_names", 3), "nul\0"),
    ((I, "reference_angles_rad"), [0.0] * 21),
    ((I, "joint_limits_rad", 2), [1.0, -1.0]),
    ((I, "joint_limits_rad", 2), [0.0, 1.0, 2.0]),
    ((I, "joint_limits_rad"), [[-1.0, 1.0]] * 19),
    ((I, "initial_target_rad", 7), 50.0),
    ((I, "initial_target_rad"), [0.0] * 3),
    ((I, "control_rate_hz"), 0),
    ((I, "control_rate_hz"), "50"),
    ((I, "observation", "history_order"), "newest_first"),
    ((I, "observation", "terms"), []),
    ((I, "observation", "terms", 0, "name"), "joint_poss"),
    ((I, "observation", "terms", 0, "name"), "command"),
    ((I, "observation", "terms", 0, "size"), 21),
    ((I, "observation", "terms", 0, "history"), 0),
    ((I, "observation", "terms", 0, "history"), 10**12),
    ((I, "observation", "terms", 0, "scale"), 0.0),
    ((I, "observation", "terms", 1, "frame"), "world"),
    ((I, "observation", "terms", 2, "unit"), "deg/s"),
    ((I, "observation", "terms", 4, "size"), -3),
    ((I, "action", "scale_rad"), -0.06),
    ((I, "action", "clip"), 0),
    ((I, "action", "transform"), "target = alpha*a"),
    ((I, "command_path", "delay_s"), -0.1),
    ((I, "command_path", "lowpass_hz"), 0),
    ((I, "command_path", "slew_rad_s"), -1),
    ((I, "command_path", "slew_rad_s"), "fast"),
    ((I, "command_path", "slew_rad_s"), [2.8] * 19),
    ((I, "command_path", "slew_rad_s"), [2.8] * 19 + [0.0]),
    ((I, "command_path", "slew_rad_s"), [2.8] * 19 + [None]),
    ((I, "command_ranges"), [[0, 1]]),
    ((I, "command_ranges", 0), [1, 0]),
    ((I, "v_quat_b"), [1.0, 1.0, 0.0, 0.0]),
    ((I, "v_quat_b"), [1.0, 0.0, 0.0]),
    (("provenance", "config_sha256"), ""),
    (("provenance", "normalizer", "count"), -1),
    (("provenance", "normalizer", "steps"), 10**30),
    (("provenance", "evaluation"), {"speed": "fast"}),
    (("provenance", "evaluation"), {"\x1b[2J": 1.0}),
    (("provenance", "versions"), {"jax": "/home/user/jax"}),
    (("parity", "obs"), []),
    (("parity", "obs", 1), [0.0] * 391),
    (("parity", "action"), [[0.0] * 20] * 7),
    (("parity", "action", 1), [0.0] * 21),
]


@pytest.mark.parametrize(("path", "value"), MALFORMED, ids=str)
def test_malformed_fields_are_named(table, path, value):
    error = _refusal(_edit(table, path, value))
    names = [str(key) for key in path if isinstance(key, str)]
    assert names[0] in error.field or error.field in ("policy.obs_size",)


def test_the_nearest_term_is_suggested(table):
    path = (I, "observation", "terms", 0, "name")
    assert "did you mean joint_pos?" in str(_refusal(_edit(table, path, "joint_poss")))


@pytest.mark.parametrize(
    "text",
    [
        "",
        "{",
        "[]",
        "null",
        '{"task": 1, "task": 2}',
        '{"schema_version": NaN}',
        '{"schema_version": 1e999}',
        "[" * 100_000,
        '{"a": ' * 100_000,
        "1" * 10_000,
        b"\xff\xfe\x00",
        "{'task': 1}",
        "%YAML 1.2",
    ],
    ids=lambda text: repr(text[:12]),
)
def test_what_is_not_strict_json_is_refused(text):
    _refusal(text)


def test_another_schema_is_refused_before_its_fields(table):
    text = _edit(json.loads(_edit(table, ("schema_version",), 2)), ("new",), 1)
    assert _refusal(text).field == "schema_version"


def test_optional_fields_may_be_null(table, bundle):
    edited = _edit(table, ("provenance", "evaluation"), None)
    read: Manifest = parse_manifest(edited, "manifest.json")
    assert read.provenance.evaluation is None
    assert read.interface == bundle.manifest.interface


def test_a_speed_limit_may_be_one_number_one_per_joint_or_none(table):
    field = (I, "command_path", "slew_rad_s")
    each = [2.8] * 12 + [2.5] * 8
    for value, wanted in ((2.5, [2.5] * 20), (each, each), (None, [np.inf] * 20)):
        read = parse_manifest(_edit(table, field, value), "manifest.json")
        assert list(read.interface.slews_rad_s) == wanted
        assert parse_manifest(dump_manifest(read), "again") == read


@pytest.mark.parametrize("bad", [float("nan"), float("inf"), -float("inf")])
def test_non_finite_numbers_are_named(table, bad):
    for path in [
        (I, "control_rate_hz"),
        (I, "action", "clip"),
        ("parity", "obs", 0, 0),
    ]:
        error = _refusal(_edit(table, path, bad))
        assert error.field.startswith(path[0]) and "finite" in str(error)


def test_a_target_rounded_to_float32_at_its_limit_is_accepted(table):
    high = table[I]["joint_limits_rad"][0][1]
    above = float(np.nextafter(np.float32(high), np.float32(9)))
    parse_manifest(_edit(table, (I, "initial_target_rad", 0), above), "manifest.json")
    refused = _edit(table, (I, "initial_target_rad", 0), high + 1e-5)
    assert "initial_target_rad[0]" in _refusal(refused).field
