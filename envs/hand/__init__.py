"""The hand: its figures, model file, MuJoCo model, drive and stance."""
