"""A separate virtual rig that solves the contact of a sphere on a bonded layer; it shares no code with any other
part of the project, including the rest of the rig."""
