"""mjlab with RSL-RL, on the hand."""
