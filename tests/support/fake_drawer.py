"""Stands in for what films a run: two frames, grey by the iteration."""

import sys
from pathlib import Path

from PIL import Image

iteration, *runs = sys.argv[1:]
for run in runs:
    assert (Path(run) / "videos" / "policies" / f"{int(iteration):08d}").is_dir()
    frames = [Image.new("L", (6, 4), shade) for shade in (int(iteration), 200)]
    path = Path(run) / "videos" / f"{int(iteration):08d}.gif"
    frames[0].save(path, save_all=True, append_images=frames[1:])
