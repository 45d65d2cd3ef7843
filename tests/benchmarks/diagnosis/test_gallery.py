"""The gallery of public records: what needs none of their data."""

import dataclasses
import json
import subprocess
import sys

import pytest

from benchmarks.diagnosis.gallery.__main__ import RECORDS, answer
from benchmarks.diagnosis.gallery.models import pendulum_model, urdf_model
from benchmarks.diagnosis.gallery.page import page
from envs.actuator.catalogue import CATALOGUE
from envs.errors import InputError
from sysid.result import Alternative, Cause, Diagnosis, Estimate, Hypothesis

URDF = b"""
<robot name="arm">
<link name="base"/>
<link name="upper"><inertial><origin xyz="0 0 0.1"/><mass value="2"/>
<inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial>
<visual><geometry><mesh filename="package://arm/upper.stl"/></geometry></visual></link>
<link name="tool"/>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/>
<axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="9" velocity="9"/>
<dynamics damping="3" friction="2"/></joint>
<joint name="wrist" type="fixed"><parent link="upper"/><child link="tool"/>
<origin xyz="0 0 0.3"/></joint>
</robot>"""


def test_a_urdf_keeps_masses_and_axes_alone():
    model = urdf_model(URDF, payload="tool")
    assert model.njnt == 1
    assert model.body("payload").id > 0
    assert model.body("upper").mass[0] == 2.0
    assert not model.dof_damping.any()
    assert not model.dof_frictionloss.any()
    assert not model.jnt_limited.any()


def test_a_pendulum_has_its_parts():
    model = pendulum_model("servo", {0.5: 0.546, 0.25: 0.13}, armature=0.002)
    assert model.joint("servo").id == 0
    assert model.body_subtreemass[1] == pytest.approx(0.676, abs=1e-4)


@pytest.mark.parametrize("name", RECORDS)
def test_every_record_names_what_it_knows(name):
    record = RECORDS[name]
    assert record.name == name
    assert record.half in ("first", "second")
    assert set(record.effects) <= set(CATALOGUE)
    assert record.documented
    assert record.where
    assert len(record.commit) == 12


def test_a_clone_that_is_missing_is_named(tmp_path):
    record = RECORDS["dfki_pendulum"]
    with pytest.raises(InputError, match="--fetch"):
        record.reader(tmp_path)


def test_records_are_read_at_their_commit(tmp_path):
    """From a clone whose newest commit says otherwise."""
    record = RECORDS["dfki_pendulum"]
    clone = record.clone(tmp_path)
    work = tmp_path / "work"
    work.mkdir()

    def git(*words):
        name = ["-c", "user.name=a", "-c", "user.email=a@b"]
        command = ["git", "-C", str(work), *name, *words]
        done = subprocess.run(command, check=True, capture_output=True, text=True)
        return done.stdout.strip()

    git("init", "--quiet")
    commits = []
    for text in ("first", "second"):
        (work / "data.csv").write_text(text)
        git("add", ".")
        git("commit", "--quiet", "-m", text)
        commits.append(git("rev-parse", "HEAD"))
    clone.parent.mkdir(parents=True)
    subprocess.run(["git", "clone", "-q", "--bare", work, clone], check=True)
    first = dataclasses.replace(record, commit=commits[0])
    assert first.reader(tmp_path)("data.csv") == b"first"
    with pytest.raises(InputError, match=r"other\.csv"):
        first.reader(tmp_path)("other.csv")


def said(effect, alike=()):
    size = {"torque_nm": Estimate(0.2, 0.1, 0.3, "N·m")}
    alternatives = [Alternative(other, 1.0, False, effect) for other in alike]
    return Diagnosis(
        verdict="ambiguous" if alike else "found",
        summary="The simulation lacks something.",
        gain=None,
        next_experiment="",
        log_sha256=(),
        seed=0,
        runtime_s=3.0,
        causes=(Cause(effect, "pendulum", size, 40.0),),
        alternatives=tuple(alternatives),
        posterior=(Hypothesis("pendulum", (effect,), 0.9),),
    )


def test_a_documented_cause_counts_in_the_set_too():
    record = RECORDS["dfki_pendulum"]
    first = answer(record, said("coulomb_friction"))
    assert (first["first"], first["right"]) == (True, True)
    beside = answer(record, said("hysteresis", ["coulomb_friction"]))
    assert (beside["first"], beside["right"]) == (False, True)
    other = answer(record, said("hysteresis"))
    assert (other["first"], other["right"]) == (False, False)


def test_a_page_says_what_authors_and_diagnosis_say():
    record = RECORDS["dfki_pendulum"]
    row = json.loads(json.dumps(answer(record, said("coulomb_friction"))))
    text = page(record, row)
    for words in (record.documented, record.commit, "0.2 (0.1 to 0.3) N·m", "90%"):
        assert words in text


def test_the_command_refuses_another_name(tmp_path):
    command = [sys.executable, "-m", "benchmarks.diagnosis.gallery"]
    done = subprocess.run(
        [*command, "--folder", str(tmp_path), "--only", "dfki_pendul"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2
    assert "did you mean dfki_pendulum" in done.stderr
    assert "Traceback" not in done.stderr
