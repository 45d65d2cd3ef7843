"""This project, as the peers are timed."""
