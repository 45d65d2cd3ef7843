"""The safety supervisor: a table of faults and a pure state machine."""

from fingers_robot.safety.limits import Limits, make_limits
from fingers_robot.safety.machine import State, initial_state, step
from fingers_robot.safety.table import ROWS, Row
from fingers_robot.safety.types import (
    Inputs,
    Mode,
    Operator,
    Outputs,
    PolicyFault,
    Proposal,
    Reaction,
)

__all__ = [
    "ROWS",
    "Inputs",
    "Limits",
    "Mode",
    "Operator",
    "Outputs",
    "PolicyFault",
    "Proposal",
    "Reaction",
    "Row",
    "State",
    "initial_state",
    "make_limits",
    "step",
]
