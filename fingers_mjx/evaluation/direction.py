"""Which direction of a measure is better, in one place, for each task.

A measure that is not listed has no better direction: it describes, as the mean command
does, or its meaning depends on others, as energy does on how long an episode lasts.
The first of a task is its main one.
"""

from collections.abc import Mapping
from typing import Literal

Better = Literal["higher", "lower"]

STANDING: dict[str, Better] = {"survival": "higher", "undesired_contact_rate": "lower"}
"""Of every task that begins and should stay on the fingertips, also a user's own."""

_SIDES = ("", "_thumb", "_wrist")
"""Over all falls, and by the side of the fall."""

BETTER: Mapping[str, Mapping[str, Better]] = {
    "crawl": {
        "task_speed_mps": "higher",
        "five_finger_participation": "higher",
        "non_nail_participation": "higher",
        "worst_tip_contact_tilt_deg": "lower",
        "worst_tip_planting_fraction": "higher",
        "cost_of_transport": "lower",
        "turn_rate_error_rad_s": "lower",
        "planar_velocity_error_mps": "lower",
        **STANDING,
        # Of a hand that is commanded to walk straight on; drifts by their size.
        "drift_deg_s": "lower",
        "sideways_mps": "lower",
        "straight_speed_mps": "higher",
        "straight_survival": "higher",
    },
    "keyboard": {
        "correct_fraction": "higher",
        "latency_median_s": "lower",
        "latency_95_s": "lower",
        "wrong_presses": "lower",
        "timeouts": "lower",
        "stray_presses": "lower",
        "max_tilt_deg": "lower",
        "stance_drift_mm": "lower",
        "least_support_fraction": "higher",
        **STANDING,
    },
    "push": {
        "delivered": "higher",
        "stopped": "lower",
        "delivered_to_20_cm": "higher",
        "delivered_20_to_30_cm": "higher",
        "delivered_from_30_cm": "higher",
        "delivery_time_s": "lower",
        "final_error_m": "lower",
        "last_error_m": "lower",
        **STANDING,
    },
    "recovery": {
        **{f"righted{side}": "higher" for side in _SIDES},
        **{f"time_to_upright_s{side}": "lower" for side in _SIDES},
        **{f"final_joint_error_rad{side}": "lower" for side in _SIDES},
    },
}


def better(task: str, measure: str) -> Better | None:
    """Returns the direction in which a measure of a task is better, None for neither.

    Args:
        task: by name; one that is not ours has what every standing hand has.
        measure: by name.
    """
    return BETTER.get(task, STANDING).get(measure)
