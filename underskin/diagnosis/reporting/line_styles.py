"""What the dash of a line means, the same in every figure.

Solid is what a figure is about: measured, stated by a diagnosis, or calculated for what was asked. Dashed is the
paper's model beside it, Hertz's or Hooke's law for curves. Dotted is a bound or an edge, and what is left out or stands
there for comparison alone. Lines of one meaning are told apart by colour, width or markers.
"""

SHOWN, PAPER, BOUND = "solid", "dash", "dot"
# Labels of a logarithmic axis in full, else 50 and 0.5 were both a 5 beside it.
WHOLE_NUMBERS = {"tickformat": "~g"}
# Of many lines beside each other: the colours of Okabe and Ito, then four more that differ from them in both schemes.
LINE_COLOURS = (
    *("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000"),
    *("#882255", "#999933", "#332288", "#8B5A2B"),
)
