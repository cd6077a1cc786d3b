"""What is happening under the skin: stress, FRF and d33 of piezoelectric electronic skin."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from underskin.errors import (
    ExtensionError,
    FileError,
    InvalidInput,
    ServiceError,
    SolverError,
    TableError,
    UnderskinError,
    Unreachable,
)

if TYPE_CHECKING:
    from underskin.client.documents import Report
    from underskin.client.service_client import Client
    from underskin.diagnosis.diagnose import diagnose, diagnose_fleet, diagnose_together
    from underskin.diagnosis.planning.rig_limits import RigLimits
    from underskin.inversion.invert import Inversion, invert
    from underskin.physics.charge_response import Indenter, Sigma, Skin
    from underskin.prediction.forward_model import Predicted, predict
    from underskin.prediction.pressed_skin import Transmission, transmission
    from underskin.recordings.campaign import Campaign, Conditions, SkinDescription, frf_conditions
    from underskin.recordings.reading import Reading, read_file
    from underskin.surrogate.sigma_table import SigmaTable, load_table
    from underskin.surrogate.solved_contact import solved_contact

__version__ = "0.2.0"

__all__ = [
    "Campaign",
    "Client",
    "Conditions",
    "ExtensionError",
    "FileError",
    "Indenter",
    "InvalidInput",
    "Inversion",
    "Predicted",
    "Reading",
    "Report",
    "RigLimits",
    "ServiceError",
    "Sigma",
    "SigmaTable",
    "Skin",
    "SkinDescription",
    "SolverError",
    "TableError",
    "Transmission",
    "UnderskinError",
    "Unreachable",
    "diagnose",
    "diagnose_fleet",
    "diagnose_together",
    "frf_conditions",
    "invert",
    "load_table",
    "predict",
    "read_file",
    "solved_contact",
    "transmission",
]

# Imported on first use: SciPy takes longer to load than `underskin --help` to answer.
_MODULES = {
    "Campaign": "recordings.campaign",
    "Client": "client.service_client",
    "Conditions": "recordings.campaign",
    "Indenter": "physics.charge_response",
    "Inversion": "inversion.invert",
    "Predicted": "prediction.forward_model",
    "Reading": "recordings.reading",
    "Report": "client.documents",
    "RigLimits": "diagnosis.planning.rig_limits",
    "Sigma": "physics.charge_response",
    "SigmaTable": "surrogate.sigma_table",
    "Skin": "physics.charge_response",
    "SkinDescription": "recordings.campaign",
    "Transmission": "prediction.pressed_skin",
    "diagnose": "diagnosis.diagnose",
    "diagnose_fleet": "diagnosis.diagnose",
    "diagnose_together": "diagnosis.diagnose",
    "frf_conditions": "recordings.campaign",
    "invert": "inversion.invert",
    "load_table": "surrogate.sigma_table",
    "predict": "prediction.forward_model",
    "read_file": "recordings.reading",
    "solved_contact": "surrogate.solved_contact",
    "transmission": "prediction.pressed_skin",
}

if not TYPE_CHECKING:  # or a type checker would believe in every name

    def __getattr__(name: str) -> Any:
        if name not in _MODULES:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        return getattr(import_module(f"{__name__}.{_MODULES[name]}"), name)
