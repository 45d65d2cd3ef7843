"""A simulator apart from the one that fits: it hides the effects."""
