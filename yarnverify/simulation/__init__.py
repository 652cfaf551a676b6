"""Cloth made of the kernels, moved and compared with answers that are known.

fabric        nodes, yarns and crossings of a yarn, a ring or a weave, and the tables of its elements
view          pictures, movies and series of what it does
"""
