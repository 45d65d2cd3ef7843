"""A hand of the user's own: from an MJCF file to a hand file and a model."""
