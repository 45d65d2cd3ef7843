"""Loaders of the gallery's records, one file each: where it is, what it documents."""
