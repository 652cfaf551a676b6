"""What people would use instead, each in a module of its name: ``make(n, alpha)`` gives a prepared ``Solve``."""

PEERS = ("jax", "elastica")
