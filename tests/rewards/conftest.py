import os

import jax
import numpy as np
import pytest


@pytest.fixture
def rng():
    seed = int(
        os.environ.get(
            "REWARDS_TEST_SEED", np.random.SeedSequence().generate_state(1)[0]
        )
    )
    print(f"REWARDS_TEST_SEED={seed}")
    return np.random.default_rng(seed)


@pytest.fixture
def x64():
    with jax.enable_x64(True):
        yield
