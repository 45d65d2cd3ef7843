import math

import pytest
from support.synthetic_sweep import STAGES, study, write_sweep

from envs.errors import InputError
from fingers_mjx.studies.comparison.comparison import check_complete, compared
from fingers_mjx.studies.comparison.files import document
from fingers_mjx.studies.comparison.results import read_results
from fingers_mjx.studies.comparison.tables import difference_rows, notes
from fingers_mjx.studies.statistics.compare import ONE_SEED
from fingers_mjx.studies.sweep.manifest import read_manifest

GAINS = {
    "lift": [0.02, 0.03, 0.025, 0.015, 0.02],
    "same": [0.001, -0.001, 0, 0.002, -0.002],
}
SPEED = "task_speed_mps"


def results(tmp_path, values, states=None):
    path = write_sweep(tmp_path / "s", values, states, curves=False)
    return read_results(path, read_manifest(path))


def test_a_known_gain_is_found_and_none_is_not(tmp_path):
    found = compared(results(tmp_path, study(GAINS)), "base", [SPEED])
    lift, same = found.rows
    assert (lift.configuration, same.configuration) == ("lift", "same")
    assert lift.difference.mean == pytest.approx(0.022)
    assert lift.difference.low < 0.022 < lift.difference.high
    assert lift.difference.in_favour == 5
    assert lift.p_holm < 0.01
    assert same.difference.low < 0 < same.difference.high
    assert same.p_holm > 0.05


def test_all_rows_are_corrected_together(tmp_path):
    one = compared(
        results(tmp_path / "1", study({"lift": GAINS["lift"]})), "base", [SPEED]
    )
    assert one.rows[0].p_holm == one.rows[0].difference.p
    both = compared(results(tmp_path / "2", study(GAINS)), "base", [SPEED, "energy_j"])
    assert len(both.rows) == 4
    assert both.rows[0].p_holm == pytest.approx(4 * both.rows[0].difference.p)
    assert notes(both)[0].startswith("4 comparisons")


def test_less_of_an_error_is_better_and_energy_is_neither(tmp_path):
    measures = ["turn_rate_error_rad_s", "energy_j"]
    slip, energy = compared(
        results(tmp_path, study({"lift": GAINS["lift"]})), "base", measures
    ).rows
    assert (slip.better, slip.difference.in_favour) == ("lower", 5)
    assert slip.difference.mean < 0 < slip.difference.improvement
    assert (energy.better, energy.difference.in_favour) == (None, None)


def test_measures_without_a_direction_are_compared_only_when_named(tmp_path):
    found = compared(results(tmp_path, study(GAINS)), "base")
    assert found.measures == ("survival", SPEED, "turn_rate_error_rad_s")


def test_seeds_that_are_missing_are_dropped_pairwise_and_named(tmp_path):
    states = {("lift", 3): ("diverged", "loss not finite")}
    whole = results(tmp_path, study(GAINS), states)
    with pytest.raises(
        InputError, match=r"1 of 15 members missing.*missing: lift/3; lift/3: diverged"
    ):
        check_complete(whole, "s")
    found = compared(whole, "base", [SPEED])
    lift, same = found.rows
    assert (lift.difference.n, lift.difference.dropped) == (4, 1)
    assert lift.difference.mean == pytest.approx((0.02 + 0.03 + 0.025 + 0.02) / 4)
    assert same.difference.n == 5
    said = "\n".join(notes(found))
    assert "lift/3, diverged" in said
    assert "left out" in said


def test_six_of_many_that_are_missing_are_named_whole_and_why_the_first_is(tmp_path):
    path = write_sweep(tmp_path / "s", study(GAINS))
    for file in path.rglob("summary.json"):
        file.write_text("{")
    whole = read_results(path, read_manifest(path))
    with pytest.raises(InputError, match="15 of 15 members missing") as error:
        check_complete(whole, "/home/somebody/work/studies/of/the/hand/" + 60 * "s")
    names = ", ".join(one.name for one in whole.missing[:6])
    assert f"missing: {names} and 9 more; base/0: done, but its" in str(error.value)
    assert str(error.value).endswith("cannot be read")


def test_one_seed_proves_nothing(tmp_path):
    found = compared(results(tmp_path, study({"lift": 0.02}, 1)), "base", [SPEED])
    (row,) = found.rows
    assert (row.difference.low, row.difference.p, row.p_holm) == (None, None, None)
    assert ONE_SEED in "\n".join(notes(found)).lower()
    assert difference_rows(found)[0][3] == "–"


def test_an_undefined_value_is_left_out_and_named(tmp_path):
    values = study(GAINS)
    values["lift"][2][SPEED] = math.nan
    found = compared(results(tmp_path, values), "base", [SPEED])
    assert found.rows[0].difference.n == 4
    assert f"{SPEED} of lift/2" in "\n".join(notes(found))


@pytest.mark.parametrize(
    ("baseline", "measures", "match"),
    [
        ("bose", None, "--baseline: found bose; valid: one of base, lift, same.*base?"),
        ("base", ["speed"], "--measures: found speed; valid: one of energy_j, surv"),
    ],
)
def test_unknown_names_are_refused_with_the_valid_ones(
    tmp_path, baseline, measures, match
):
    with pytest.raises(InputError, match=match):
        compared(results(tmp_path, study(GAINS)), baseline, measures)


def test_seeds_of_one_arm_alone_are_named(tmp_path):
    values = study(GAINS, 5)
    values["lift"] |= {7: values["lift"][0], 8: values["lift"][1]}
    del values["base"][4]
    found = compared(results(tmp_path, values), "base", [SPEED])
    lift, same = found.rows
    assert (lift.difference.n, lift.difference.dropped) == (4, 3)
    assert (same.difference.n, same.difference.dropped) == (4, 1)
    assert "lift (4, 7, 8), same (4)" in "\n".join(notes(found))


def test_nothing_done_is_not_compared(tmp_path):
    states = {(name, 0): ("waiting", "") for name in ("base", "lift")}
    whole = results(tmp_path, study({"lift": 0.02}, 1), states)
    with pytest.raises(InputError, match="none done"):
        compared(whole, "base")


def test_one_configuration_cannot_be_compared(tmp_path):
    with pytest.raises(InputError, match="two configurations"):
        compared(results(tmp_path, study({})), "base")


def test_seeds_that_are_missing_for_one_reason_share_a_line(tmp_path):
    states = {("lift", seed): ("waiting", "") for seed in (1, 3)}
    states["lift", 4] = ("failed", "killed")
    found = compared(results(tmp_path, study({"lift": 0.1}, 5), states), "base")
    lines = [note for note in notes(found) if note.startswith("Missing: ")]
    assert [line.partition(", wait")[0] for line in lines[:1]] == ["Missing: lift/1, 3"]
    assert lines[1].startswith("Missing: lift/4, failed") and len(lines) == 2


def test_seeds_that_were_trained_anew_are_named(tmp_path):
    """Negative control: what diverged of a member that is missing changes nothing."""
    path = write_sweep(tmp_path / "s", study({"lift": [0.1] * 5}), curves=False)
    last = path / "runs/lift/3" / STAGES[-1]
    last.with_name(f"{last.name}~diverged").mkdir()
    found = compared(read_results(path, read_manifest(path)), "base", [SPEED])
    assert found.results.anew == {"lift": (3,)}
    assert document(found)["trained_anew"] == {"lift": [3]}
    [sentence] = [note for note in notes(found) if "trained anew" in note]
    assert "lift: seeds 3" in sentence
    (last / "eval/summary.json").unlink()
    assert read_results(path, read_manifest(path)).anew == {}


def test_seeds_that_chose_a_configuration_do_not_count_for_it(tmp_path):
    """Of five seeds the first two chose it, and are the best ones: for their luck."""
    lucky = study({"lift": [0.2, 0.2, 0.0, 0.01, -0.01]})
    path = write_sweep(tmp_path / "s", lucky, curves=False)
    manifest = read_manifest(path)
    found = compared(read_results(path, manifest, {"lift": (0, 1)}), "base", [SPEED])
    [row] = found.rows
    assert row.difference.n == 3
    assert row.difference.mean == pytest.approx(0.0, abs=1e-6)
    assert sorted(found.cell("lift", SPEED).values) == [2, 3, 4]
    assert "Left out, since they chose lift: seeds 0, 1." in notes(found)
    naive = compared(read_results(path, manifest), "base", [SPEED])
    assert naive.rows[0].difference.mean == pytest.approx(0.08, abs=1e-6)
