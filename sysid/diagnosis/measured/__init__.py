"""What was measured, as the replay needs it."""
