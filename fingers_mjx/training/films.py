"""Videos of the policies while they learn, drawn by a process of their own.

Training only writes the networks and goes on; `fingers_mjx.play.film_run` plays and
draws at low priority, on the CPU. What it has drawn is put into the learning curve.
"""

import importlib.util
import os
import subprocess
import sys
from collections.abc import Callable, Sequence

from fingers_mjx.ppo.config import TrainConfig
from fingers_mjx.ppo.state import Carry
from fingers_mjx.runs import checkpoint
from fingers_mjx.runs.metrics import MetricsLog
from fingers_mjx.runs.videos import policies_folder, video_file
from fingers_mjx.training.member import Place

DRAWER = "fingers_mjx.play.film_run"
NEEDED = ("PIL", "imageio_ffmpeg", "matplotlib", "jinja2")
LAST_S = 300.0
"""How long the end of a run waits for its last video."""


def check_drawable(config: TrainConfig) -> None:
    """Looks for what draws videos, without importing it.

    Raises:
        ModuleNotFoundError: videos are asked for, and a package is missing.
    """
    for name in NEEDED if config.video_every else ():
        if importlib.util.find_spec(name) is None:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)


class Films:
    """The videos of a run or a population; one process draws at a time.

    Args:
        config: of all members.
        places: of the members' files.
        logs: their learning curves.
        note: takes a sentence for the user.
    """

    def __init__(
        self,
        config: TrainConfig,
        places: Sequence[Place],
        logs: Sequence[MetricsLog],
        note: Callable[[str], None],
    ):
        self._every, self._note = config.video_every, note
        self._members = list(zip(places, logs, strict=True))
        self._child: subprocess.Popen[str] | None = None
        self._iteration = 0

    def due(self, iteration: int) -> bool:
        """Whether a video of this iteration is asked for, and nothing else is drawn."""
        asked = self._every > 0 and iteration % self._every == 0
        return asked and self._child is None

    def start(self, carries: Sequence[Carry], iteration: int) -> None:
        """Begins to draw the policies of an iteration.

        Args:
            carries: states of the members.
            iteration: iterations done.
        """
        self._iteration = iteration
        for (place, _), carry in zip(self._members, carries, strict=True):
            folder = policies_folder(place.path)
            folder.mkdir(parents=True, exist_ok=True)
            meta = {"bound": place.bound}
            checkpoint.save(folder, iteration, {"train": carry.train}, meta, keep=1)
        command = [sys.executable, "-m", DRAWER, str(iteration)]
        command += [str(place.path) for place, _ in self._members]
        self._child = subprocess.Popen(
            command,
            env={**os.environ, "JAX_PLATFORMS": "cpu"},
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,  # Ctrl-C is for the training
        )

    def collect(self) -> None:
        """Puts the videos that are done into the learning curves; never waits."""
        if self._child is None or self._child.poll() is None:
            return
        errors = (self._child.communicate()[1] or "").strip().splitlines()
        if self._child.returncode:
            why = errors[-1] if errors else f"status {self._child.returncode}"
            self._note(f"no video of iteration {self._iteration}: {why}")
        self._child = None
        for place, log in self._members:
            path = video_file(place.path, self._iteration)
            if path.exists():
                log.append_video(self._iteration, path)

    def finish(self) -> None:
        """Waits for the video that is being drawn, at the end of a run."""
        if self._child is None:
            return
        try:
            self._child.wait(LAST_S)
        except subprocess.TimeoutExpired:
            self._note(f"the video of iteration {self._iteration} takes too long")
            self.stop()
        self.collect()

    def stop(self) -> None:
        """Gives up the video that is being drawn."""
        if self._child is not None and self._child.poll() is None:
            self._child.terminate()
            self._child.wait()
