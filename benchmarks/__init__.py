"""What was measured, and how: speed, and how often a diagnosis is right."""
