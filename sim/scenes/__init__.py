"""Named generators of worlds, each a function of a seed."""
