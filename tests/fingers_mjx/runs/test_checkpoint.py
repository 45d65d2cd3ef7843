"""Checkpoints: bit-equal, committed at once, damage always found, full disks named.

T2 (SIGKILL at named points), T5 (damage), T6 (full disk); X8 (what files show).
"""

import errno
import json
import os
import random
import resource
import shutil
import subprocess
import sys
from collections import namedtuple
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from support import checkpoint_child

from envs.errors import InputError
from fingers_mjx.runs import checkpoint
from fingers_mjx.runs import files as rundir_files
from fingers_mjx.runs.files import OutOfSpace
from fingers_mjx.runs.tree import to_host

POINTS = checkpoint_child.PROTOCOL


class Death(BaseException):
    """Stands in for SIGKILL: no handler of the protocol may see it."""


def state(number=0):
    return {
        "key": jax.random.key(number),
        "keys": jax.random.split(jax.random.key(number, impl="rbg"), 3),
        "odd": jnp.array([jnp.nan, -0.0, jnp.inf, 1e-45]),
        "count": jnp.uint32(2**32 - 1 - number),
        "flags": jnp.array([True, False]),
        "half": jnp.arange(3, dtype=jnp.bfloat16),
        "nothing": jnp.zeros((0, 4)),
        "nested": ({"a/b": jnp.arange(6.0).reshape(2, 3) + number},),
    }


def save(directory, number, keep=3, reached=lambda point: None):
    meta = {"note": number}
    with checkpoint_child.watched_steps(reached):
        return checkpoint.save(directory, number, state(number), meta, keep)


def assert_equal(one, other):
    a, b = to_host(one), to_host(other)
    assert a.keys() == b.keys()
    for name in a:
        assert a[name].dtype == b[name].dtype
        assert a[name].shape == b[name].shape
        assert a[name].tobytes() == b[name].tobytes(), name


def ignore(text):
    pass


def test_everything_comes_back_bit_for_bit(tmp_path):
    saved = checkpoint.load(save(tmp_path, 7))
    assert (saved.iteration, saved.meta["note"]) == (7, 7)
    back = saved.into(jax.eval_shape(state))
    assert_equal(back, state(7))
    assert jax.random.key_impl(back["keys"]) == jax.random.key_impl(state()["keys"])
    with pytest.raises(AssertionError):
        assert_equal(back, state(8))  # negative control


def test_newest_are_kept(tmp_path):
    for number in range(1, 6):
        save(tmp_path, number, keep=2)
    names = [p.name for p in checkpoint.checkpoints(tmp_path)]
    assert names == ["00000004", "00000005"]
    assert {p.name for p in tmp_path.iterdir()} == set(names)


def test_files_are_readable_by_all_and_name_nobody(tmp_path):
    path = save(tmp_path, 1)
    modes = {p.is_dir(): p.stat().st_mode & 0o777 for p in path.rglob("*")}
    assert modes == {True: 0o755, False: 0o644}
    home = str(Path.home()).encode()
    assert not [p for p in path.rglob("*") if p.is_file() and home in p.read_bytes()]


@pytest.mark.parametrize("point", POINTS)
def test_sudden_death_leaves_the_newest_complete_checkpoint(tmp_path, point):
    save(tmp_path, 1)
    save(tmp_path, 2)

    def die(reached):
        if reached == point:
            raise Death

    with pytest.raises(Death):
        save(tmp_path, 3, keep=2, reached=die)
    checkpoint.clean(tmp_path)
    newest = checkpoint.newest(tmp_path, ignore)
    expected = 3 if POINTS.index(point) >= POINTS.index("renamed") else 2
    assert newest.name == f"{expected:08d}"
    assert_equal(checkpoint.load(newest).into(jax.eval_shape(state)), state(expected))
    assert not list(tmp_path.glob(".*"))
    save(tmp_path, 3)  # and the next save works
    assert checkpoint.newest(tmp_path, ignore).name == "00000003"


@pytest.mark.parametrize("repeats", [1, pytest.param(5, marks=pytest.mark.slow)])
def test_kill_at_any_point_leaves_the_newest_complete_checkpoint(tmp_path, repeats):
    """The same with real processes and SIGKILL, also in the middle of writing."""
    script = Path(checkpoint_child.__file__)
    root = script.parents[2]
    paths = os.pathsep.join([str(root), str(root / "deploy")])
    subprocess.run(
        [sys.executable, str(script), str(tmp_path), str(repeats)],
        env=os.environ | {"JAX_PLATFORMS": "cpu", "PYTHONPATH": paths},
        check=True,
    )
    trials = sorted(tmp_path.iterdir())
    assert len(trials) == repeats * len(checkpoint_child.POINTS) == 12 * repeats
    for trial in trials:
        point = trial.name.rpartition("-")[0]
        checkpoint.clean(trial)
        newest = checkpoint.newest(trial, ignore)
        number = int(newest.name)
        assert number == (3 if point in POINTS[POINTS.index("renamed") :] else 2)
        arrays = checkpoint.load(newest).arrays
        assert_equal(arrays, to_host(checkpoint_child.state(number)))
        assert not list(trial.glob(".*"))


def test_points_are_all_reached(tmp_path):
    reached = []
    save(tmp_path, 1)
    save(tmp_path, 2, keep=1, reached=reached.append)
    assert tuple(reached) == POINTS


def flip(path, rng):
    data = bytearray(path.read_bytes())
    data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
    path.write_bytes(bytes(data))


def truncate(path, rng):
    path.write_bytes(path.read_bytes()[: rng.randrange(path.stat().st_size)])


def delete(path, rng):
    path.unlink()


def add(path, rng):
    (path.parent / "stranger").write_bytes(b"")


def damage_each_file(directory, rng, repeats):
    """Damages each file of the newest checkpoint in each way; yields what is said."""
    newest = checkpoint.checkpoints(directory)[-1]
    copy = directory / "copy"
    shutil.copytree(newest, copy)
    names = sorted(p.relative_to(copy) for p in copy.rglob("*") if p.is_file())
    for name in names:
        for way in (flip,) * repeats + (truncate, delete, add):
            way(newest / name, rng)
            said = []
            yield checkpoint.newest(directory, said.append), said, newest
            shutil.rmtree(newest)
            shutil.copytree(copy, newest)


@pytest.mark.parametrize("repeats", [2, pytest.param(20, marks=pytest.mark.slow)])
def test_every_damage_is_found_and_reported(tmp_path, repeats):
    seed = random.randrange(10**6)
    print(f"seed {seed}")
    save(tmp_path, 1)
    save(tmp_path, 2)
    trials = 0
    for found, said, newest in damage_each_file(tmp_path, random.Random(seed), repeats):
        assert found.name == "00000001"
        assert len(said) == 1
        assert str(newest) in said[0]
        trials += 1
    assert trials >= 50
    said = []
    assert checkpoint.newest(tmp_path, said.append).name == "00000002"  # undamaged
    assert said == []


def test_swapped_checkpoints_are_found(tmp_path):
    one, two = save(tmp_path, 1), save(tmp_path, 2)
    one.rename(tmp_path / "x")
    two.rename(one)
    (tmp_path / "x").rename(two)
    with pytest.raises(InputError, match="only damaged checkpoints"):
        checkpoint.newest(tmp_path, ignore)


def test_damaged_checkpoint_asked_for_is_an_error(tmp_path):
    path = save(tmp_path, 1)
    (path / "meta.json").unlink()
    with pytest.raises(InputError, match=r"meta.json is missing"):
        checkpoint.load(path)
    with pytest.raises(InputError, match="00000009"):
        checkpoint.load(tmp_path / "00000009")


def test_none_yet_is_not_an_error(tmp_path):
    assert checkpoint.newest(tmp_path, ignore) is None


def test_damaged_ones_are_set_aside(tmp_path):
    save(tmp_path, 1)
    flip(save(tmp_path, 2) / "meta.json", random.Random(0))
    checkpoint.set_aside(tmp_path, 1)
    assert [p.name for p in checkpoint.checkpoints(tmp_path)] == ["00000001"]
    assert (tmp_path / "damaged-00000002").is_dir()


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"count": jnp.zeros(2, jnp.uint32)}, "count"),
        ({"flags": jnp.zeros(2)}, "flags"),
        ({"key": jax.random.key(0, impl="rbg")}, "key"),
        ({"extra": jnp.zeros(())}, "extra"),
    ],
)
def test_other_layout_is_refused_by_name(tmp_path, change, field):
    saved = checkpoint.load(save(tmp_path, 1))
    with pytest.raises(InputError) as error:
        saved.into(jax.eval_shape(lambda: state() | change))
    assert error.value.field == field


def test_part_can_be_taken_alone(tmp_path):
    saved = checkpoint.load(save(tmp_path, 3))
    part = saved.part({"nested": jax.eval_shape(state)["nested"]})
    assert_equal(part, {"nested": state(3)["nested"]})


def test_full_disk_is_seen_before_writing(tmp_path, monkeypatch):
    save(tmp_path, 1)
    usage = namedtuple("usage", "total used free")
    full = usage(10**9, 10**9 - 1000, 1000)
    monkeypatch.setattr(rundir_files.shutil, "disk_usage", lambda path: full)
    with pytest.raises(OutOfSpace, match="00000002") as error:
        save(tmp_path, 2)
    assert error.value.free == 1000 < error.value.needed
    assert error.value.exit_code == 4
    assert checkpoint.newest(tmp_path, ignore).name == "00000001"


def test_write_that_fails_half_way_leaves_the_old_ones(tmp_path):
    """A limit of file size makes every large write fail, Orbax's C++ ones included."""
    save(tmp_path, 1)
    big = {"big": jnp.asarray(np.random.default_rng(0).normal(size=(500, 500)))}
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, hard))
    try:
        with pytest.raises(OutOfSpace, match="00000002"):
            checkpoint.save(tmp_path, 2, big, {}, 3)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert [p.name for p in tmp_path.iterdir()] == ["00000001"]
    assert checkpoint.newest(tmp_path, ignore).name == "00000001"
    checkpoint.save(tmp_path, 2, big, {}, 3)  # negative control: without the limit


@pytest.mark.parametrize(
    "point", ["made", "state written", "meta written", "sealed", "name free"]
)
def test_no_space_at_any_point(tmp_path, point):
    save(tmp_path, 1)

    def fill(reached):
        if reached == point:
            raise OSError(errno.ENOSPC, "No space left on device")

    with pytest.raises(OutOfSpace):
        save(tmp_path, 2, reached=fill)
    assert [p.name for p in tmp_path.iterdir()] == ["00000001"]


def test_other_errors_are_not_taken_for_a_full_disk(tmp_path):
    def refuse(reached):
        raise PermissionError(errno.EACCES, "Permission denied")

    with pytest.raises(PermissionError):
        save(tmp_path, 1, reached=refuse)


def test_notes_are_plain_json(tmp_path):
    meta = json.loads((save(tmp_path, 4) / "meta.json").read_text(encoding="utf-8"))
    assert meta["iteration"] == 4
    assert meta["leaves"]["keys"] == "key<rbg>[3]"
    assert meta["leaves"]["nested/0/a/b"] == "float32[2,3]"
