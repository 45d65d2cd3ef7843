"""Candidates that were evaluated before are remembered."""

import numpy as np

from sysid.diagnosis.fits import memory
from sysid.diagnosis.fits.memory import remembered


def test_only_new_candidates_are_evaluated(monkeypatch):
    asked, known = [], {}

    def ask(*values):
        thetas = np.array(values, float)[:, None]

        def squares(new):
            asked.append(thetas[new, 0].tolist())
            return thetas[new] ** 2

        return remembered(known, thetas, squares)[:, 0]

    assert ask(3.0, 1.0, 3.0).tolist() == [9.0, 1.0, 9.0]
    assert ask(1.0, 2.0).tolist() == [1.0, 4.0]
    assert ask(2.0, 3.0).tolist() == [4.0, 9.0]
    assert asked == [[3.0, 1.0], [2.0]]
    monkeypatch.setattr(memory, "MOST_BYTES", 8)  # two results
    assert ask(1.0, 2.0).tolist() == [1.0, 4.0] and len(known) == 2
    assert ask(3.0).tolist() == [9.0] and asked[2:] == [[3.0]]
