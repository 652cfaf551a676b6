"""How fast the kernels are, how accurate, and how fast and accurate what people would use instead is.

In the order of work:

    inputs       named states of a declared energy, ordinary and hard
    contestants  the kernels' variants and the peers, each with its ways of being called
    timing       paired repetitions: every round times every contestant
    errors       each contestant's outputs against the exact result
    run          all of it, as one record

Timings are shown and never compared with committed values.
"""
