"""A policy in its worlds, as the viewer steps them."""

import dataclasses
from pathlib import Path

from support.cli_setup import make_bundle, make_setup

from fingers_deploy import load_bundle
from fingers_mjx.evaluation.setups import nominal
from fingers_mjx.play.player import Player
from fingers_mjx.play.viewer.live import Live
from fingers_mjx.play.viewer.watch import Watched
from fingers_mjx.runs.setup import Setup, make_env


def make_watched(folder: Path, **given) -> Watched:
    setup = nominal(make_setup())
    bundle = load_bundle(make_bundle(folder / "bundle", setup))

    # Each hand once: what costs is compiling.
    players: dict[str, Player] = {}

    def make(setup: Setup) -> Player:
        if setup.hand.sha256 not in players:
            players[setup.hand.sha256] = new(setup)
        return players[setup.hand.sha256]

    def new(setup: Setup) -> Player:
        return Player(make_env(setup, 1, "cpu"), bundle)

    return Watched("crawl: test", setup, make, **given)


def make_live(watched: Watched) -> Live:
    setup = watched.setup
    return Live(
        lambda hand: watched.make(dataclasses.replace(setup, hand=hand)), setup.hand
    )
