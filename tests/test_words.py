"""The field's words: no dialect in names, docstrings, messages and documents."""

import re

import pytest
from support.house import PACKAGES, ROOT

DIALECT = {
    r"told|tells?|hears|heard": "reported, measured, observed, distinguishes",
    r"news": "outside or within tolerance",
    r"loud(er)?|dull|shaken|shakes": "noise gain, smoothed",
    r"bent": "off-prior",
    r"doubts?": "uncertainty, standard error",
    r"rivals?": "alternatives, indistinguishable set",
    r"led along": "replayed along the measured motion",
    r"Desk|Told|Lasting": "the thing's own name",
}
WORDS = re.compile("|".join(rf"(?<![a-z])(?:{words})(?![a-z])" for words in DIALECT))
PLACES = [*PACKAGES.values(), ROOT / "docs", ROOT / "tests", ROOT / "deploy" / "tests"]
FILES = sorted(
    [path for place in PLACES for path in place.rglob("*") if path.is_file()]
    + list(ROOT.glob("*.md"))
    + list(ROOT.glob("deploy/*.md"))
)
TEXTS = [
    f for f in FILES if f.suffix in (".py", ".md", ".html") and f.stem != "test_words"
]


def found(text):
    """The words of the dialect in a text."""
    return sorted({m[0] for m in WORDS.finditer(text)})


def test_the_dialect_is_not_spoken():
    assert len(TEXTS) > 500
    texts = {str(f.relative_to(ROOT)): f.read_text("utf-8") for f in TEXTS}
    assert {name: words for name, text in texts.items() if (words := found(text))} == {}


@pytest.mark.parametrize("text", ["is told", "def _tell(", "rival_of", "no news"])
def test_a_word_of_the_dialect_is_seen(text):
    """Negative control."""
    assert found(text)
