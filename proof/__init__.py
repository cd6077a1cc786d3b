"""Judges the diagnosis on concealed campaigns, on this project's virtual rig, and on real recordings."""
