"""What the figures of a diagnosis have in common: colours of Okabe and Ito, which colour-blind people tell apart, and
the layout. Black is what was measured, orange the model before, blue the one after, grey the band of the noise.
"""

import plotly.graph_objects as go
import plotly.io as pio

PLAIN = {"exponentformat": "none"}  # else ticks had prefixes beside the unit of their axis: 10μ of N
TEMPLATE = go.layout.Template(pio.templates["plotly_white"]).update(
    layout={"xaxis": PLAIN, "yaxis": PLAIN}, data={"heatmap": [{"colorbar": PLAIN}]}
)
MEASURED, BEFORE, AFTER, BAND = "#000000", "#D55E00", "#0072B2", "rgba(0,0,0,0.15)"


def styled(figure: go.Figure) -> go.Figure:
    """The figure in the layout of all."""
    figure.update_layout(template=TEMPLATE, font={"size": 14, "color": "#222222"})
    return figure
