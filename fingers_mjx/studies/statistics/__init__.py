"""Statistics over seeds: what few trainings of each configuration can show."""
