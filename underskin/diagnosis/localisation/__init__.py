"""Where recordings and model disagree, how much, and in which shape."""
