"""Counting on a terminal and into a file."""

from fingers_mjx.training.counting import counting


class Terminal:
    """A stream that says that it is one."""

    def __init__(self, live):
        self.live, self.text = live, ""

    def isatty(self):
        return self.live

    def write(self, text):
        self.text += text

    def flush(self):
        pass


def test_counting_is_one_live_line_on_a_terminal():
    stream = Terminal(live=True)
    with counting(stream, "drawing", "frames") as count:
        count(1, 2)
        count(2, 2)
    assert stream.text.count("\n") == 1
    assert stream.text.rstrip().endswith("drawing: 2 of 2 frames")


def test_counting_keeps_few_lines_where_they_are_kept():
    stream = Terminal(live=False)
    with counting(stream, "drawing", "frames") as count:
        for index in range(100):
            count(index + 1, 100)
    lines = stream.text.splitlines()
    assert len(lines) <= 3
    assert '"done": 100' in lines[-1]
