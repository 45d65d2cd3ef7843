"""The demonstration: evaluate, play, train, export, one report."""
