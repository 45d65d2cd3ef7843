"""Which policy a result is of, to the bit."""

import hashlib

import numpy as np

from fingers_mjx.policy.actor import Network


def digest(network: Network) -> str:
    """Returns the SHA-256 of a policy's float32 numbers, as checkpoint or as bundle.

    Args:
        network: normalizer and layers.
    """
    arrays = [network.mean, network.std, *(x for pair in network.layers for x in pair)]
    flat = [np.asarray(array, np.float32).ravel() for array in arrays]
    return hashlib.sha256(np.concatenate(flat).tobytes()).hexdigest()
