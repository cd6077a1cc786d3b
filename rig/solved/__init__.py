"""A virtual rig of its own that solves the contact of a sphere on a bonded layer; it shares no code with any other
part of the project, the rest of the rig included."""
