import pytest

from fingers_robot.cli.words import HELP, MAX_KEYS, Word, parse


@pytest.mark.parametrize("text", ["arm", "stop", "off", "clear", "quit"])
def test_a_plain_word_is_sent_as_it_is(text):
    assert parse(f"  {text} \r".encode(), 1) == Word(text, (text,))


def test_status_is_for_the_console_alone():
    assert parse(b"status", 1) == Word("status", ())


@pytest.mark.parametrize(("typed", "sent"), [(b"policy 1", "1"), (b"policy  01", "1")])
def test_a_policy_that_there_is_can_be_selected(typed, sent):
    assert parse(typed, 2) == Word("policy", (f"policy {sent}",))


@pytest.mark.parametrize(
    "number", ["2147483648", "9" * 400, "7", "2", "-1", "²", "١", "1.0", "1_0", "x"]
)
def test_a_policy_that_there_is_not_is_refused_with_what_there_is(number):
    said = parse(f"policy {number}".encode(), 2)
    assert isinstance(said, str) and said.endswith("valid: 0 to 1")
    assert len(said) < 120 and said.isprintable() and "\n" not in said


@pytest.mark.parametrize(
    "line",
    [
        *(b"arm now", "árm".encode(), b"\xff\xfe", "stop\u202e".encode(), b"a" * 5000),
        *(b"policy", b"keys", b"keys left x", b"keys " + b"up " * (MAX_KEYS + 1)),
    ],
)
def test_anything_else_is_answered_by_what_may_be_typed(line):
    said = parse(line, 3)
    assert isinstance(said, str) and HELP in said
    assert len(said) < 200 and said.isprintable()


@pytest.mark.parametrize("degrees", ["30", "-15", "+7.5", "180"])
def test_a_turn_is_sent_where_a_heading_is_held(degrees):
    line = f"turn {degrees}".encode()
    assert parse(line, 1, holds=True) == Word("turn", (f"turn {degrees}",))
    assert parse(line, 1) == "found turn; valid with --heading-hold GAIN OFFSET"


@pytest.mark.parametrize(
    "degrees", ["181", "nan", "inf", "1e2", "x", "١", "--3", "9999"]
)
def test_a_turn_that_is_none_is_refused_with_what_is_valid(degrees):
    said = parse(f"turn {degrees}".encode(), 1, holds=True)
    assert isinstance(said, str) and said.endswith("to the left positive")


def test_keys_go_one_by_one():
    assert parse(b"keys left up", 1) == Word("keys", ("key left", "key up"))
