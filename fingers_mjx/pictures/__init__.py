"""Pictures and films of the hand."""
