"""What is happening under the skin: stress, FRF and d33 of piezoelectric electronic skin."""

from underskin.errors import InvalidInput, ServiceError, SolverError, TableError, UnderskinError
from underskin.prediction import Transmission, transmission
from underskin.skin import Indenter, Skin
from underskin.surrogate import Sigma, SigmaTable, load_table

__version__ = "0.1.0"

__all__ = [
    "Indenter",
    "InvalidInput",
    "ServiceError",
    "Sigma",
    "SigmaTable",
    "Skin",
    "SolverError",
    "TableError",
    "Transmission",
    "UnderskinError",
    "load_table",
    "transmission",
]
