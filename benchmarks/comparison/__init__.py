"""This project beside its peers: rows of figures, and a table made of them."""
