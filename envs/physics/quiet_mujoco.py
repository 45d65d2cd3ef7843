"""MuJoCo without its log; modules that compile or step models import it from here.

By default every warning, such as that of a world that diverges, is printed and appended
to MUJOCO_LOG.TXT in the working directory, which may be anybody's. What matters of it
reaches us through the results: a diverged world is NaN and counted, a model that does
not compile is an exception.
"""

import mujoco

_config = mujoco.MjLogConfig.get()
_config.logto_console = _config.logto_file = False
_config.set()

__all__ = ["mujoco"]
