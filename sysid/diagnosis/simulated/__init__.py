"""The angle that the servo's simulation predicts from targets alone, and fits to it."""
