"""Cloth made of the kernels, moved and compared with answers that are known.

fabric, tables        nodes, yarns and crossings of a yarn, a ring or a weave, and the tables of its elements
assembly, pattern     from kernels and tables to energy, gradient and sparse Hessian
linear, newton        solving: linear systems, equilibria
dynamics              motion by implicit Euler, the midpoint rule or BDF2
answers               what is known: exact, or to many more digits than a scene has
scene, setting        what a scene is: parameters with units, a problem at rest or in motion, known answers
scenes                the scenes, a file each
runs, state           a run, step by step, from its start or from a saved state to the same end
study, goals          a scene at several sizes and in several ways: errors, orders, seconds
command, record       ``yarnverify simulate``, and the record behind its page
view                  pictures, movies and series of what it does
"""
