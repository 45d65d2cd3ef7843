"""Bad inputs: damaged, hostile files and words, for every reader and command."""
