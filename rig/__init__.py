"""A virtual rig: recordings of a piezoelectric skin under a sphere, with or without hidden physics, and their truth.

It imports no other package of the project, so a diagnosis tested on its recordings is tested on independent equations.
"""
