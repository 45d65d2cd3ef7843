"""System identification: from measured logs of a hand to its hand model file."""
