"""Where the members of a population are: run directories inside its own."""

MEMBERS = "members"
