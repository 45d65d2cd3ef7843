"""Training, evaluation, export and the command line for hands that walk."""
