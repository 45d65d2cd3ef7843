"""Logs and their map, as the actions of `fingers sysid` read them."""

import pytest
from support.sysid_logs import small_log

from envs.errors import InputError
from fingers_mjx.cli.sysid import records
from sysid.logs.read import write_log


def test_a_map_without_a_bag_is_refused(tmp_path):
    log, bag_map = tmp_path / "x.csv", tmp_path / "map.yaml"
    write_log(small_log(), log)
    bag_map.write_text("imu: /imu\n", encoding="utf-8")
    with pytest.raises(InputError, match="one with a bag"):
        records.read([log], bag_map)


def test_a_map_belongs_to_the_bags_alone(tmp_path, monkeypatch):
    seen = {}
    monkeypatch.setattr("envs.config.typed.load_yaml", lambda kind, path: "map")
    monkeypatch.setattr("sysid.logs.read.read_log", seen.setdefault)
    records.read([tmp_path / "x.csv", tmp_path / "y.mcap", tmp_path], tmp_path)
    assert list(seen.values()) == [None, "map", "map"]
