"""Words of the command line: options, settings as flags, completion."""
