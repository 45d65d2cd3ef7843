"""UniLab's first PPO iterations on its own quadruped, through its own command.

Its scenes are named from a source checkout, `src/unilab/…`, which a folder of links to
the installed package stands in for. Meshes are downloaded when first used.
"""

import subprocess
import sys
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path

from benchmarks.comparison.workers.report import arguments, say

TASK = ("--algo", "ppo", "--task", "go2_joystick_flat", "--sim", "mujoco")


def main() -> None:
    """Trains one iteration and says so."""
    args = arguments()
    found = find_spec("unilab")
    assert found and found.origin
    link = args.out / "src" / "unilab"
    link.parent.mkdir(parents=True, exist_ok=True)
    if not link.exists():
        link.symlink_to(Path(found.origin).parent)
    program = [str(Path(sys.executable).with_name("train")), *TASK]
    program += ["--render-mode", "none", f"algo.num_envs={args.worlds}"]
    program += ["algo.max_iterations=1"]
    done = subprocess.run(program, cwd=args.out, stdout=sys.stderr, check=False)
    if done.returncode:
        raise SystemExit(done.returncode)
    about = f"unilab {version('unilab')}, torch {version('torch')}"
    say(
        first=True, version=about, note="Go2 quadruped, velocity commands; not the hand"
    )


if __name__ == "__main__":
    main()
