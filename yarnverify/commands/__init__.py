"""The commands, each a function whose heavy imports happen inside, so that ``--help`` answers at once."""
