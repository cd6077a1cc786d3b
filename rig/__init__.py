"""A virtual rig: recordings of a piezoelectric skin under a sphere, with or without hidden physics, and their truth.

It stands alone, so that software tested on its recordings is tested on equations that are not its own.
"""
