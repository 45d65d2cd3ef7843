"""Damage that happens to logs: by disks, by editors, by hand, and on purpose."""

import numpy as np

HOSTILE = ("../outside.mcap", "/etc/passwd", "~/x.mcap", "a" * 4096, "\0", "")


def torn(whole: bytes, rng: np.random.Generator) -> bytes:
    """Truncates, and changes up to three bytes."""
    data = bytearray(whole[: rng.integers(0, len(whole) + 1)])
    return flipped(bytes(data), rng)


def flipped(whole: bytes, rng: np.random.Generator) -> bytes:
    """Flips up to three bits."""
    data = bytearray(whole)
    for place in rng.integers(0, len(data), rng.integers(1, 4)) if data else ():
        data[place] ^= 1 << rng.integers(0, 8)
    return bytes(data)


def csv_damage(text: str, rng: np.random.Generator) -> bytes:
    """One of what a person or a program does to a CSV log."""
    return _CSV[rng.integers(len(_CSV))](text, rng)


def _lines(text: str) -> tuple[list[str], list[str]]:
    lines = text.splitlines()
    first = next(i for i, line in enumerate(lines) if not line.startswith("#"))
    return lines[: first + 1], lines[first + 1 :]


def _joined(head: list[str], rows: list[str]) -> bytes:
    return "\n".join([*head, *rows, ""]).encode()


def _cell(value: str):
    """Puts a text into a random cell."""

    def change(text, rng):
        head, rows = _lines(text)
        row = int(rng.integers(len(rows)))
        cells = rows[row].split(",")
        cells[rng.integers(len(cells))] = value
        rows[row] = ",".join(cells)
        return _joined(head, rows)

    return change


def _rows_swapped(text, rng):
    head, rows = _lines(text)
    return _joined(head, [rows[i] for i in rng.permutation(len(rows))])


def _rows_repeated(text, rng):
    head, rows = _lines(text)
    row = int(rng.integers(len(rows)))
    return _joined(head, rows[:row] + [rows[row]] * 5 + rows[row:])


def _rows_lost(text, rng):
    head, rows = _lines(text)
    return _joined(head, rows[: rng.integers(0, 3)])


def _column_lost(text, rng):
    head, rows = _lines(text)
    lost = int(rng.integers(head[-1].count(",") + 1))

    def without(line):
        cells = line.split(",")
        return ",".join(cells[:lost] + cells[lost + 1 :])

    return _joined([*head[:-1], without(head[-1])], [without(row) for row in rows])


def _comma_decimals(text, rng):
    head, rows = _lines(text)
    return _joined(head, [row.replace(".", ",") for row in rows])


def _header_changed(text, rng):
    head, rows = _lines(text)
    words = ("deg", "[", "!!python/object:os.system", "&a [*a]", "units: 3", "-")
    line = int(rng.integers(len(head)))
    head[line] = head[line][: rng.integers(len(head[line]))] + str(rng.choice(words))
    return _joined(head, rows)


def _times(scale: float, jump: float):
    """Scales times, and lets the clock jump in the middle."""

    def change(text, rng):
        head, rows = _lines(text)
        for i, row in enumerate(rows):
            t, _, rest = row.partition(",")
            late = jump if i > len(rows) // 2 else 0.0
            rows[i] = f"{float(t) * scale + late!r},{rest}"
        return _joined(head, rows)

    return change


_CSV = (
    *(_cell(x) for x in ("nan", "inf", "-inf", "1e999", "0x10", '"', "٣", "1_0", " ")),
    _cell("9" * 5000),
    _rows_swapped,
    _rows_repeated,
    _rows_lost,
    _column_lost,
    _comma_decimals,
    _header_changed,
    _times(-1.0, 0.0),
    _times(1.0, -1.0),
    _times(1.0, 1e9),
    _times(0.0, 0.0),
    lambda text, rng: text.encode("utf-16"),
    lambda text, rng: b"\xef\xbb\xbf" + text.encode(),
    lambda text, rng: text.replace(",", ";").encode(),
    lambda text, rng: torn(text.encode(), rng),
    lambda text, rng: flipped(text.encode(), rng),
)
