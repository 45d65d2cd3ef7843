"""Steering: what a policy makes of fixed commands, and how it holds a heading."""
