"""From the selected model to causes, evidence and advice."""
