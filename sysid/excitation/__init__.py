"""What to record, so that effects can be identified."""
