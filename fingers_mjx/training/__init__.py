"""The training loop: from a run directory to a trained policy."""
