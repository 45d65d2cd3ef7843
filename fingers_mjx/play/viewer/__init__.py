"""The closed loop live in the browser: the hand, what acts on it, and knobs."""
