"""Run directories: settings, checkpoints, metrics."""
