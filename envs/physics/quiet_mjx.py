"""The one place that imports MJX, which prints where it should not.

Without warp-lang, `import mujoco.mjx` prints two "Failed to import warp" lines on
standard output, which belongs to the JSON and tables of our commands. What it says is
kept in `IMPORT_MESSAGES`, so that asking for Warp can still say why it is missing.
"""

import contextlib
import io

_printed = io.StringIO()
with contextlib.redirect_stdout(_printed):
    from mujoco import mjx
    from mujoco.mjx.warp import WARP_INSTALLED

IMPORT_MESSAGES = " ".join(_printed.getvalue().split())

__all__ = ["IMPORT_MESSAGES", "WARP_INSTALLED", "mjx"]
