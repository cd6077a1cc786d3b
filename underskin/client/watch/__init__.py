"""A folder that instruments save into, watched: what is complete is sent, once."""
