"""A simulated hand in a process of its own; needs the extra `sim`."""
