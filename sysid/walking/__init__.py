"""What the simulation of a walking hand lacks."""
