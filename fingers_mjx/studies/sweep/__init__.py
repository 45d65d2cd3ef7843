"""Sweeps: configurations × seeds × stages, trained and evaluated one by one."""
