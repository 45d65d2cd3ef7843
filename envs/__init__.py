"""Environments of the hand: model and drive, physics, signals, tasks and registry."""
