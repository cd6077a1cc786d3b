"""What the dash of a line means, the same in every figure.

Solid is what a figure is about: measured, stated by a diagnosis, or calculated for what was asked. Dashed is the
paper's model beside it, Hertz's or Hooke's law for curves. Dotted is a bound or an edge, and what is left out or stands
there for comparison alone. Lines of one meaning are told apart by colour, width or markers.
"""

SHOWN, PAPER, BOUND = "solid", "dash", "dot"
