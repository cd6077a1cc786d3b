"""Files of which a soak alone runs every test, and whose modules take long to load."""

from bench.soak import SOAK

collect_ignore = [] if SOAK else ["test_paper.py", "test_block.py", "test_cylinder.py"]
