"""Drivers: a simulated hand, a recorded one, and the WUJI hand, behind one protocol."""
