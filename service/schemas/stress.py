"""What `POST /v1/stress` takes and answers, as OpenAPI describes it; `underskin.stress_request` checks it."""

from pydantic import Field

from service.schemas.base import StrictRequest
from service.schemas.columns import AnswerInColumns, FindingModel
from underskin.array_stress.request import MOST_CONTACTS
from underskin.surrogate.sigma_table import ContactName


class StressSensor(StrictRequest):
    """A sensor of the array."""

    id: str = Field(description="Its name, one of its own.")
    x_mm: float = Field(description="Its centre along the skin's length [mm].")
    y_mm: float = Field(description="Its centre along the skin's width [mm].")


class StressContact(StrictRequest):
    """A rigid sphere, pressed in without friction; its tangential force is spread like its pressure."""

    x_mm: float = Field(description="Centre of the contact, in the sensors' frame [mm].")
    y_mm: float = Field(description="Centre of the contact, in the sensors' frame [mm].")
    indenter_radius_mm: float = Field(gt=0, description="Radius R of the sphere [mm].")
    normal_force_n: float = Field(gt=0, description="Force into the skin [N].")
    tangential_force_n: list[float] | None = Field(
        default=None, min_length=2, max_length=2, description="Force on the skin along x and y; left out: none [N]."
    )


class StressMap(StrictRequest):
    """Pressure into the skin, constant around each of evenly spaced places."""

    x_mm: list[float] = Field(min_length=2, description="Places of the columns, evenly spaced, ascending [mm].")
    y_mm: list[float] = Field(min_length=2, description="Places of the rows, evenly spaced, ascending [mm].")
    pressure_mpa: list[list[float]] = Field(min_length=2, description="Pressure, y × x, at least 0 [MPa].")


class StressRequest(StrictRequest):
    """A skin with its sensors, and either contacts or a pressure map."""

    thickness_mm: float = Field(gt=0, description="Thickness h of the layer over the sensors [mm].")
    youngs_modulus_mpa: float | None = Field(
        default=None,
        gt=0,
        description="Young's modulus E of the layer; needed with contacts, a check of the peak with a map [MPa].",
    )
    poisson_ratio: float | None = Field(
        default=0.5, ge=0, le=0.5, description="Poisson's ratio ν, within the table's range, 0.3 to 0.5 [-]."
    )
    glue_stiffness: float | None = Field(
        default=None, ge=0, description="κ of the glue line, τ = κ (G/h) u_r at the base [-]; left out or null: bonded."
    )
    sensor_radius_mm: float = Field(gt=0, description="Radius rT of a sensor [mm].")
    d33_pc_per_n: float = Field(description="Piezoelectric coefficient d33 of the sensors [pC/N].")
    length_mm: float | None = Field(
        default=None,
        gt=0,
        description="Extent along x about the middle of the sensors; loads outside are refused [mm].",
    )
    width_mm: float | None = Field(default=None, gt=0, description="The same along y [mm].")
    sensors: list[StressSensor] = Field(min_length=1, description="The sensors of the array.")
    contacts: list[StressContact] | None = Field(
        default=None, min_length=1, max_length=MOST_CONTACTS, description="Spheres, none over another."
    )
    pressure_map: StressMap | None = Field(default=None, description="Instead of contacts: a map of pressure.")
    contact: ContactName = Field(
        default="paper",
        description="`paper`: small strain. `solved`: with what finite strain adds beneath each contact, on a bonded "
        "layer of ν 0.5. In both the contacts are the layer's own.",
    )
    units_checked: bool = Field(default=False, description="Accept magnitudes that look like a slip of units.")


class StressAnswer(AnswerInColumns):
    """One entry a sensor, in the order of the request."""

    contact: ContactName = Field(description="As asked.")
    sensor: list[str] = Field(description="The sensor's id.")
    x_mm: list[float] = Field(description="Its centre [mm].")
    y_mm: list[float] = Field(description="Its centre [mm].")
    charge_pc: list[float | None] = Field(description="Charge, positive in compression for a positive d33 [pC].")
    charge_error_pc: list[float | None] = Field(
        description="Bound on the table's error, with what loads beyond its reach may add, which count as 0; "
        "not on what a linear layer leaves out: see findings [pC]."
    )
    mean_stress_mpa: list[float | None] = Field(description="Mean stress on the sensor, positive in compression [MPa].")
    reach_mm: float = Field(
        description="How far from a sensor the table knows a load; a sensor farther from all is out_of_domain [mm]."
    )
    contact_radius_mm: list[float] = Field(
        description="Radius of each contact on this layer, smaller than Hertz's on a half space; empty for a map [mm]."
    )
    findings: list[FindingModel] = Field(
        description="What makes it doubtful: finite strain, slipping, what looks like a slip of units."
    )
