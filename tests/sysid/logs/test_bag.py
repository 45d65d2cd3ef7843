"""Bags are written by rosbags itself: its writer knows nothing of our reader."""

import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from envs.errors import InputError
from sysid.logs.bag import BagMap
from sysid.logs.read import read_log

TYPES = get_typestore(Stores.ROS2_HUMBLE)
MSG = TYPES.types
JOINTS, IMU, POSE = (
    "sensor_msgs/msg/JointState",
    "sensor_msgs/msg/Imu",
    "geometry_msgs/msg/PoseStamped",
)
TURN = np.sqrt(0.5)


def header(t_ns):
    time = MSG["builtin_interfaces/msg/Time"](t_ns // 10**9, t_ns % 10**9)
    return MSG["std_msgs/msg/Header"](time, "palm")


def joints(t_ns, position, effort=()):
    lists = (np.array(x, dtype=float) for x in (position, (), effort))
    return MSG[JOINTS](header(t_ns), ["j1", "j2"], *lists)


def imu(t_ns, first_covariance=0.0):
    vector = MSG["geometry_msgs/msg/Vector3"]
    covariance = np.full(9, first_covariance)
    turned = MSG["geometry_msgs/msg/Quaternion"](TURN, 0.0, 0.0, TURN)
    gyro, up = vector(0.1, 0.2, 0.3), vector(0.0, 0.0, 9.81)
    return MSG[IMU](header(t_ns), turned, covariance, gyro, covariance, up, covariance)


def pose(t_ns):
    point = MSG["geometry_msgs/msg/Point"](1.0, 2.0, 3.0)
    turned = MSG["geometry_msgs/msg/Quaternion"](TURN, 0.0, 0.0, TURN)
    return MSG[POSE](header(t_ns), MSG["geometry_msgs/msg/Pose"](point, turned))


def write(folder, messages, plugin=StoragePlugin.MCAP):
    """Writes (topic, type, received [ns], message) as a bag."""
    with Writer(folder, version=9, storage_plugin=plugin) as writer:
        open_topics = {}
        for topic, kind, t_ns, message in messages:
            if topic not in open_topics:
                made = writer.add_connection(topic, kind, typestore=TYPES)
                open_topics[topic] = made
            data = TYPES.serialize_cdr(message, kind)
            writer.write(open_topics[topic], t_ns, data)
    return folder


def record(start_ns=10**18):
    """Targets at 100 Hz, state at 200 Hz, 2 ms late in the bag, IMU at 50 Hz."""
    for i in range(40):
        t_ns = start_ns + i * 5_000_000
        late = t_ns + 2_000_000
        if i % 2 == 0:
            yield "/joint_commands", JOINTS, late, joints(t_ns, (0.1 * i, 0.0))
        if i % 4 == 0:
            yield "/imu", IMU, late, imu(t_ns)
            yield "/pose", POSE, late, pose(t_ns)
        yield "/joint_states", JOINTS, late, joints(t_ns, (0.01 * i, 1.0), (0.5, -0.5))


def load_map(**fields):
    return BagMap(imu="/imu", pose="/pose", effort="cur", **fields)


@pytest.mark.parametrize("plugin", list(StoragePlugin))
def test_a_bag_is_read_row_by_row(tmp_path, plugin):
    log = read_log(write(tmp_path / "bag", record(), plugin), load_map())
    assert log.header.joints == ("j1", "j2")
    assert len(log) == 20 + 10 + 10 + 40
    times, targets = log.samples("cmd.j1")
    assert times == pytest.approx(np.arange(20) * 0.01)
    assert targets == pytest.approx(np.arange(20) * 0.2)
    assert log.samples("cur.j2")[1] == pytest.approx(np.full(40, -0.5))
    assert log.timing("pos.j1").period_s == pytest.approx(0.005)
    assert log.timing("pos.j1").regular
    assert log.samples("gyro.y")[1] == pytest.approx(np.full(10, 0.2))
    assert log.samples("base.qx")[1] == pytest.approx(np.full(10, TURN))
    assert not any(name.startswith("vel.") for name in log.columns)


def test_gravity_follows_the_orientation(tmp_path):
    """A sensor rolled by +90 degrees about x has the world's down at -y."""
    log = read_log(write(tmp_path / "bag", record()), load_map())
    down = [log.samples(f"gravity.{axis}")[1][0] for axis in "xyz"]
    assert down == pytest.approx([0.0, -1.0, 0.0], abs=1e-12)


def test_no_gravity_where_the_imu_estimates_no_orientation(tmp_path):
    messages = [
        (topic, kind, t, imu(t, -1.0) if kind == IMU else message)
        for topic, kind, t, message in record()
    ]
    log = read_log(write(tmp_path / "bag", messages), load_map())
    assert "gyro.x" in log.columns
    assert "gravity.x" not in log.columns


def test_a_bare_mcap_file_and_a_map_of_joints(tmp_path):
    (file,) = write(tmp_path / "bag", record()).glob("*.mcap")
    log = read_log(file, load_map(joints={"knee": "j2"}))
    assert log.header.joints == ("knee",)
    assert log.samples("pos.knee")[1] == pytest.approx(np.ones(40))
    assert "pos.j1" not in log.columns


def test_the_clock_is_the_one_asked_for(tmp_path):
    unstamped = [
        (topic, kind, t, joints(0, (0.0, 0.0)))
        for topic, kind, t, _ in record()
        if kind == JOINTS
    ]
    bag = write(tmp_path / "bag", unstamped)
    with pytest.raises(InputError, match="clock: received"):
        read_log(bag)
    log = read_log(bag, BagMap(clock="received"))
    assert log.t_s[-1] == pytest.approx(39 * 0.005)


def test_bags_that_are_refused(tmp_path):
    bag = write(tmp_path / "bag", record())
    with pytest.raises(InputError, match=r"no /imuu; .*did you mean /imu"):
        read_log(bag, BagMap(imu="/imuu"))
    with pytest.raises(InputError, match=r"no cmd\.hip"):
        read_log(bag, BagMap(joints={"hip": "j9", "knee": "j1"}))
    with pytest.raises(InputError, match="with a bag or MCAP file only"):
        (tmp_path / "x.csv").write_text("")
        read_log(tmp_path / "x.csv", BagMap())
    torn = joints(10**18, (0.0,))
    bad = write(tmp_path / "bad", [*record(), ("/joint_states", JOINTS, 10**18, torn)])
    with pytest.raises(InputError, match="/joint_states: found 1 values of pos for 2"):
        read_log(bad)


def test_nothing_outside_the_folder_is_read(tmp_path):
    bag = write(tmp_path / "bag", record())
    (file,) = bag.glob("*.mcap")
    file.rename(tmp_path / "elsewhere.mcap")
    file.symlink_to(tmp_path / "elsewhere.mcap")
    with pytest.raises(InputError, match="files inside the folder"):
        read_log(bag)


def test_damaged_bags_never_end_in_another_error(tmp_path):
    rng = np.random.default_rng(seed := 5)
    for number, plugin in enumerate(StoragePlugin):
        bag = write(tmp_path / f"bag{number}", record(), plugin)
        refused = 0
        for file in bag.iterdir():
            whole = file.read_bytes()
            for _ in range(30):
                data = bytearray(whole[: rng.integers(0, len(whole) + 1)])
                for place in rng.integers(0, len(data), 3) if data else ():
                    data[place] = rng.integers(0, 256)
                file.write_bytes(data)
                try:
                    read_log(bag)
                except InputError:
                    refused += 1
            file.write_bytes(whole)
        assert refused > 25, (seed, plugin)
