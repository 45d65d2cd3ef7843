"""Detectors of faults: pure functions of one reading and of what is remembered."""
