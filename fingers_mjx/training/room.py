"""What a run says when the physics had no room for all contacts."""

import math
from collections.abc import Iterator, Mapping
from typing import Any

from envs.errors import InputError
from envs.physics.room import ROOM, too_little_room

GO_ON = ", or on_overflow=warn to go on without them; either also with --resume"


def overflows(
    figures: Mapping[str, float], when: str, num_envs: int, config: Any
) -> Iterator[InputError]:
    """Yields an error for each buffer that was too small.

    Args:
        figures: of one or more iterations, see `fingers_mjx.training.row`.
        when: the iterations, for the sentence.
        num_envs: worlds of the run.
        config: settings of the task.
    """
    for metric in ROOM:
        if worlds := math.ceil(figures.get(f"{metric}_worlds", 0.0)):
            what = metric.removesuffix("_overflow")
            source = f"{when}: {what}s dropped in {worlds} of {num_envs} worlds"
            yield too_little_room(source, metric, config, GO_ON)
