"""Public records of other people's robots, and what their authors say of them.

    python -m benchmarks.diagnosis.gallery --folder clones --fetch

Nothing of these data is part of this project: `--fetch` clones what is missing. The
documented cause of each record was written down before any verdict about it was looked
at. Half of the records, drawn by a seed (`half`), are for development; the others are
for one look at the end.
"""
