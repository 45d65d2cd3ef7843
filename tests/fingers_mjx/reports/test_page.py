import html.parser
import math
import re

import numpy as np
import pytest

from envs.errors import InputError
from fingers_mjx.reports.figures import gait_diagram
from fingers_mjx.reports.page import (
    Commands,
    Note,
    Picture,
    Section,
    Table,
    measures_table,
    picture,
    provenance,
    shown,
    video,
    write_report,
)

EVIL = '<script>alert("x")</script> & \'"'


class Page(html.parser.HTMLParser):
    """Collects tags, attributes and text, and refuses unbalanced tags."""

    VOID = {"meta", "img", "br", "link"}

    def __init__(self, text):
        super().__init__()
        self.tags, self.open, self.words = [], [], []
        self.feed(text)
        assert not self.open

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.words.append(data)


def read(path):
    return Page(path.read_text(encoding="utf-8"))


def test_page_holds_everything_and_loads_nothing(tmp_path):
    clip = tmp_path / "walk.mp4"
    clip.write_bytes(b"\0\0\0\x18ftypmp42")
    sections = [
        Section("Result", [Note("It walks."), Table(("a", "b"), [("x", 0.123456)])]),
        Section("Gait", [picture(gait_diagram(np.ones((9, 5), bool), 0.02), "bars")]),
        Section("Video", [video(clip, "16 s"), Commands(["make demo"])]),
        provenance(["fingers eval crawl"], commit="0123abc"),
    ]
    page = read(write_report(tmp_path / "report.html", sections, "Crawl"))
    sources = [a["src"] for _, a in page.tags if "src" in a]
    assert [s.split(",")[0] for s in sources] == [
        "data:image/png;base64",
        "data:video/mp4;base64",
    ]
    links = [a["href"] for _, a in page.tags if "href" in a]
    assert links == ["#s1", "#s2", "#s3", "#s4"]
    assert {"script", "link", "iframe"}.isdisjoint(tag for tag, _ in page.tags)
    text = " ".join(page.words)
    for word in ("It walks.", "0.1235", "make demo", "0123abc", "Crawl", "mujoco"):
        assert word in text


def test_everything_is_escaped(tmp_path):
    blocks = [
        Note(EVIL),
        Commands([EVIL]),
        Table((EVIL,), [(EVIL,)], EVIL),
        Picture("data:image/png;base64,", EVIL),
    ]
    path = write_report(tmp_path / "r.html", [Section(EVIL, blocks)] * 2, EVIL)
    page = read(path)
    assert "script" not in {tag for tag, _ in page.tags}
    assert page.words.count(EVIL) == 2 + 2 + 2 * 7  # titles, links, blocks
    alt = [attributes["alt"] for tag, attributes in page.tags if tag == "img"]
    assert alt == [EVIL, EVIL]


@pytest.mark.parametrize(
    ("cell", "text"),
    [(0.123456, "0.1235"), (3, "3"), ("x", "x"), (None, "–"), (math.nan, "–")],
)
def test_cells_are_short(cell, text):
    assert shown(cell) == text


def test_measures_become_rows():
    measure = {"mean": 0.1, "std": 0.02, "n": 256, "low": 0.09, "high": None}
    table = measures_table({"measures": {"task_speed_mps": measure}})
    assert table.rows == [("task_speed_mps", 0.1, 0.02, 0.09, None, 256)]
    assert len(table.header) == len(table.rows[0])


def test_provenance_names_versions(tmp_path):
    rows = dict(provenance(commit="abc").blocks[0].rows)
    assert rows["commit"] == "abc"
    assert re.fullmatch(r"3\.17\.\d+", rows["mujoco"])


def test_media_must_exist_and_be_what_they_are_called(tmp_path):
    with pytest.raises(InputError, match=r"walk\.avi.*\.mp4"):
        video(tmp_path / "walk.avi")
    with pytest.raises(InputError, match="no such file"):
        video(tmp_path / "walk.mp4")
    with pytest.raises(InputError, match=r"\.png, \.webp, \.gif"):
        picture(tmp_path / "walk.mp4")


def test_the_report_is_replaced_as_a_whole(tmp_path):
    path = write_report(tmp_path / "r.html", [Section("one", [])])
    write_report(path, [Section("two", [])])
    assert "one" not in read(path).words
    assert list(tmp_path.iterdir()) == [path]
