"""The robot side of a policy: drivers, loop, supervisor, recorder, behaviours."""
