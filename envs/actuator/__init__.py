"""The actuator chain: from a commanded target to a torque, and back to a reading."""
