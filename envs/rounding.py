"""Rounding on the CPU that does not depend on how many worlds are stepped."""

import os
import platform
from collections.abc import MutableMapping
from importlib import metadata

from packaging.version import Version

from envs.config.xla_flags import add_flags

WITHOUT_FMA = "--xla_cpu_max_isa=AVX"
WITHOUT_YNN = "--xla_cpu_experimental_ynn_fusion_type=-reduce"
_FIRST_YNN = Version("0.11.1")
"""The first jaxlib of ours that has YNNPACK; others die of a flag they do not know."""


def fix_rounding(environment: MutableMapping[str, str] = os.environ) -> None:
    """Asks XLA for the same bits of a world in a batch of any usual size.

    XLA rounds a·b + c once where it fuses it and twice where it does not, and it sums
    small arrays in another order than large ones. Which it does depends on how a loop
    vectorizes, and so on the number of worlds. Here it gets no fused instruction and no
    library for sums. Vector and scalar code of exp and log still differ, so the number
    of worlds must be 1, 2, 4 or a multiple of 8; that of arctan (not arctan2) in JAX
    0.11 at any number, and that of log1p and erfinv, with which normal numbers are
    drawn, in JAX 0.8. GPU programs are not concerned, nor is any processor but x86, on
    which alone XLA can be kept from fusing.

    To be called before JAX computes anything. A flag that is set already stays.

    Args:
        environment: variables of the process.
    """
    if platform.machine() not in ("x86_64", "AMD64"):
        return
    flags = [WITHOUT_FMA]
    if Version(metadata.version("jaxlib")) >= _FIRST_YNN:
        flags.append(WITHOUT_YNN)
    add_flags(environment, flags)
