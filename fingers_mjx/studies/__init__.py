"""Studies over seeds: what several trainings of each configuration show together."""
