"""Figures of arrays, FRFs, histories and designs: the same in pages, reports and notebooks.

They are built from columns in lab units. Colours can be told apart by colour-blind readers, and what a colour shows is
also shown by a marker, a dash or the text under the pointer.
"""
