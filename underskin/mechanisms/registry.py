"""All mechanisms by name, in the order in which a model composes them."""

from underskin.mechanisms.base import Mechanism
from underskin.mechanisms.laws.adhesion import Adhesion
from underskin.mechanisms.laws.ageing import Ageing
from underskin.mechanisms.laws.amplifier_high_pass import AmplifierHighPass
from underskin.mechanisms.laws.amplitude_nonlinearity import AmplitudeNonlinearity
from underskin.mechanisms.laws.compressible_layer import CompressibleLayer
from underskin.mechanisms.laws.contact_creep import ContactCreep
from underskin.mechanisms.laws.contact_resonance import ContactResonance
from underskin.mechanisms.laws.crosstalk import Crosstalk
from underskin.mechanisms.laws.instrument_compliance import InstrumentCompliance
from underskin.mechanisms.laws.interface_slip import InterfaceSlip
from underskin.mechanisms.laws.layered_contact import LayeredContact
from underskin.mechanisms.laws.mains_pickup import MainsPickup
from underskin.mechanisms.laws.misalignment import Misalignment
from underskin.mechanisms.laws.modulus_error import ModulusError
from underskin.mechanisms.laws.moving_contact_edge import MovingContactEdge
from underskin.mechanisms.laws.platen_friction import PlatenFriction
from underskin.mechanisms.laws.preload_dependent_d33 import PreloadDependentD33
from underskin.mechanisms.laws.sensor_relaxation import SensorRelaxation
from underskin.mechanisms.laws.sensor_spread import SensorSpread
from underskin.mechanisms.laws.strain_stiffening import StrainStiffening
from underskin.mechanisms.laws.thickness_error import ThicknessError
from underskin.mechanisms.laws.timing_delay import TimingDelay

CATALOGUE: dict[str, Mechanism] = {
    mechanism.name: mechanism
    for mechanism in (
        ModulusError(),
        ThicknessError(),
        CompressibleLayer(),
        InterfaceSlip(),
        ContactCreep(),
        StrainStiffening(),
        Misalignment(),
        LayeredContact(),
        Adhesion(),
        MovingContactEdge(),
        AmplitudeNonlinearity(),
        PreloadDependentD33(),
        SensorSpread(),
        Crosstalk(),
        Ageing(),
        ContactResonance(),
        SensorRelaxation(),
        AmplifierHighPass(),
        TimingDelay(),
        MainsPickup(),
        InstrumentCompliance(),
        PlatenFriction(),
    )
}
