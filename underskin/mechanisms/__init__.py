"""What the base model may have left out: one file a mechanism, and the models that they make up.

model = compose(["moving_contact_edge", "contact_resonance"], campaign, table)
prediction = model.predict(np.array([parameter.start for parameter in model.parameters]))
"""

from underskin.mechanisms.base import (
    HeavyTailed,
    Kind,
    Mechanism,
    Normal,
    Parameter,
    Stage,
    Uniform,
    Unsupported,
    Values,
)
from underskin.mechanisms.models.composed import Model, Prediction, compose
from underskin.mechanisms.models.contact_state import Contacts, FrfState
from underskin.mechanisms.models.curve_state import Curve
from underskin.mechanisms.registry import CATALOGUE

__all__ = [
    "CATALOGUE",
    "Contacts",
    "Curve",
    "FrfState",
    "HeavyTailed",
    "Kind",
    "Mechanism",
    "Model",
    "Normal",
    "Parameter",
    "Prediction",
    "Stage",
    "Uniform",
    "Unsupported",
    "Values",
    "compose",
]
