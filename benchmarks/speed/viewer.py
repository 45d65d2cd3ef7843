"""How soon the viewer shows the hand, how fast its loop is, and a picture of the page.

    python -m benchmarks.speed.viewer --json viewer.json
    python -m benchmarks.speed.viewer --picture docs/images/viewer.webp --ghost LOG

Starts `fingers play --viewer` in a process of its own and opens the page in headless
Chromium, which draws in software. Prints seconds from the command to the address, to
the hand on the page and to a simulation that runs; then, in this process, control steps
per second of the loop without waiting for real time: the simulation alone, with the
page, and with effects of the drive. Real time is 50 of them.
"""

import argparse
import dataclasses
import io
import json
import socket
import subprocess
import sys
import time
from pathlib import Path

from PIL import Image

from benchmarks.speed.browser import Tab, opened
from envs.rounding import fix_rounding
from fingers_mjx.demo.demo import POLICY_DIR
from fingers_mjx.evaluation.setups import nominal, without_practice
from fingers_mjx.play.player import Player
from fingers_mjx.play.viewer.live import Live
from fingers_mjx.play.viewer.page import Page, serving
from fingers_mjx.play.viewer.watch import Loop, Watched, knobs_for
from fingers_mjx.play.viewer.wishes import Wishes
from fingers_mjx.policy.source import load_bundle_setup
from fingers_mjx.runs.setup import Setup, make_env

STEPS = 300
CLOSE = "document.querySelectorAll('.mantine-Notification-closeButton')"


def main() -> None:
    """Measures, and prints or writes what was measured."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", type=Path)
    parser.add_argument("--picture", type=Path)
    parser.add_argument("--ghost", type=Path)
    args = parser.parse_args()
    found = page_seconds(args.picture, args.ghost)
    if args.picture is None:
        found |= loop_rates()
    text = json.dumps({k: round(v, 1) for k, v in found.items()}, indent=1)
    print(text)
    if args.json:
        args.json.write_text(text + "\n")


def page_seconds(picture: Path | None, ghost: Path | None) -> dict[str, float]:
    """Returns seconds from the command to what a person sees.

    Args:
        picture: file for a picture of the page; none if None.
        ghost: a measured log.
    """
    command = [sys.executable, "-m", "fingers_mjx.cli.main", "play", "--viewer"]
    command += ["--port", str(_free_port()), "--command", "0.12", "0", "0"]
    command += [] if ghost is None else ["--ghost", str(ghost)]
    begin = time.perf_counter()
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    try:
        assert process.stdout is not None
        url = process.stdout.readline().split()[1]
        found = {"address_s": time.perf_counter() - begin}
        with opened(url) as tab:
            tab.wait_for("pause")
            found["page_s"] = time.perf_counter() - begin
            tab.wait_for("running,")
            found["running_s"] = time.perf_counter() - begin
            if picture is not None:
                _save(tab, picture)
        return found
    finally:
        process.terminate()
        process.wait(20)


def loop_rates() -> dict[str, float]:
    """Returns control steps per second of the loop on this machine."""
    fix_rounding()
    bundle, trained = load_bundle_setup(POLICY_DIR)

    def make(setup: Setup) -> Player:
        return Player(make_env(setup, 1, "cpu"), bundle)

    watched = Watched("crawl", without_practice(nominal(trained)), make)
    setup = watched.setup
    live = Live(lambda hand: make(dataclasses.replace(setup, hand=hand)), setup.hand)
    plain = Wishes((0.12, 0.0, 0.0))
    found = {"simulation_steps_per_s": _rate(lambda: live.step(plain))}
    with serving(_free_port()) as server:
        loop = Loop(live, Page(server, live.model, knobs_for(watched), "crawl"), None)
        found["with_page_steps_per_s"] = _rate(loop.step)
    felt = dataclasses.replace(plain, effects={"deadband": 0.01})
    found["with_effects_steps_per_s"] = _rate(lambda: live.step(felt))
    return found


def _rate(step) -> float:
    step()
    step()
    begin = time.perf_counter()
    for _ in range(STEPS):
        step()
    return STEPS / (time.perf_counter() - begin)


def _save(tab: Tab, picture: Path) -> None:
    """Saves a picture of a hand that has walked for a while.

    It stands still for it: a browser that draws in software is late with the arrows.
    """
    time.sleep(4.0)
    tab.value(f"{CLOSE}.forEach(button => button.click())")
    tab.click("pause")
    tab.wait_for("paused")
    time.sleep(2.0)
    image = Image.open(io.BytesIO(tab.picture())).convert("RGB")
    image.save(picture, quality=85)


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


if __name__ == "__main__":
    main()
