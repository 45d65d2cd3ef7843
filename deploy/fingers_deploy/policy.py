"""Running the policy: ONNX Runtime where it is installed, NumPy everywhere."""

from collections.abc import Callable
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from fingers_deploy.bundle import Bundle, check_parity
from fingers_deploy.errors import BundleError

Policy = Callable[[NDArray[np.float32]], NDArray[np.float32]]
Runtime = Literal["auto", "onnxruntime", "numpy"]


class OnnxPolicy:
    """The graph in ONNX Runtime, on one thread.

    Args:
        model: a verified ONNX file.

    Raises:
        ImportError: ONNX Runtime is not installed.
    """

    def __init__(self, model: bytes):
        import onnxruntime

        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = options.inter_op_num_threads = 1
        self._session: Any = onnxruntime.InferenceSession(
            model, options, providers=["CPUExecutionProvider"]
        )

    def __call__(self, obs: NDArray[np.float32]) -> NDArray[np.float32]:
        """Returns the clipped output [A] for an observation [N], both float32."""
        return self._session.run(["action"], {"obs": obs[None]})[0][0]


def load_policy(bundle: Bundle, runtime: Runtime = "auto") -> Policy:
    """Makes the policy of a bundle and checks it against the known answers.

    Args:
        bundle: a verified bundle.
        runtime: "onnxruntime", "numpy", or "auto" for the first that is installed.

    Raises:
        BundleError: unknown or missing runtime, or one that gives other answers.
    """
    policy = _make(bundle, runtime)
    check_parity(bundle, policy)
    return policy


def _make(bundle: Bundle, runtime: Runtime) -> Policy:
    if runtime == "numpy":
        return bundle.network
    if runtime not in ("auto", "onnxruntime"):
        raise BundleError("runtime", "", runtime, "one of auto, onnxruntime, numpy")
    try:
        return OnnxPolicy(bundle.model)
    except ImportError as error:
        if runtime == "auto":
            return bundle.network
        valid = "runtime numpy, or pip install onnxruntime (the extra [onnx])"
        raise BundleError("runtime", "", "no ONNX Runtime", valid) from error
