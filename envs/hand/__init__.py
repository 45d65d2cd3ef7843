"""The hand: nominal parameters, hand file, MuJoCo model, drive and stance."""
