"""Fits of one set of effects: coordinates, priors, starts, candidates, intervals."""
