"""Physics of one world: state in, state and sensors out; see `backends` for which."""
