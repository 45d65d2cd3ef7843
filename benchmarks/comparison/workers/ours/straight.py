"""This project's hand on what the walking peers are asked for: straight on, calm.

The crawl with one nominal hand, no noise, the peers' one command and rewards of the
literature without a term for the gait. Drive, delay and history stay.
"""

from benchmarks.comparison.workers.ours.walk import train_to_walk
from benchmarks.comparison.workers.walking import COMMAND_MPS, START_RAD
from fingers_mjx.evaluation.setups import nominal, with_command, with_fields
from fingers_mjx.runs.setup import Setup


def straight(setup: Setup) -> Setup:
    """Returns the settings with the peers' command, their start and no disturbance."""
    calm = with_command(nominal(setup), (COMMAND_MPS, 0.0, 0.0))
    return with_fields(calm, rewards="stock", reset_joint_rad=START_RAD)


if __name__ == "__main__":
    note = f"rewards stock, {COMMAND_MPS} m/s forward, nominal hand, no noise"
    train_to_walk(straight, note)
