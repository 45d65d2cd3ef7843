"""The t of block means, as SciPy has it."""

import numpy as np
import pytest
from scipy.stats import ttest_1samp

from sysid.diagnosis.likelihood.predictive_accuracy import t_of_blocks

SIZE = 10


def gained():
    rng = np.random.default_rng(0)
    return rng.normal(0.3, 1.0, (60, 2)), np.ones((60, 2), bool)


def test_the_t_is_that_of_the_block_means():
    x, counts = gained()
    blocks = x.reshape(6, SIZE, 2).mean(1).ravel()
    wanted = ttest_1samp(blocks, 0.0).statistic
    assert t_of_blocks(x, counts, SIZE) == pytest.approx(wanted)


def test_what_does_not_count_is_left_out():
    x, counts = gained()
    x[:SIZE], counts[:6] = np.nan, False  # less than half of the first blocks counts
    x[6:SIZE] = 1e3
    wanted = ttest_1samp(x.reshape(6, SIZE, 2)[1:].mean(1).ravel(), 0.0).statistic
    assert t_of_blocks(x, counts, SIZE) == pytest.approx(wanted)
    assert t_of_blocks(x[:20], counts[:20] & False, SIZE) == 0.0
