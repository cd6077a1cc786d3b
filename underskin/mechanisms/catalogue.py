"""All mechanisms by name, in the order in which a model composes them."""

from underskin.mechanisms.adhesion import Adhesion
from underskin.mechanisms.ageing import Ageing
from underskin.mechanisms.amplifier_high_pass import AmplifierHighPass
from underskin.mechanisms.amplitude_nonlinearity import AmplitudeNonlinearity
from underskin.mechanisms.compressible_layer import CompressibleLayer
from underskin.mechanisms.contact_creep import ContactCreep
from underskin.mechanisms.contact_resonance import ContactResonance
from underskin.mechanisms.crosstalk import Crosstalk
from underskin.mechanisms.instrument_compliance import InstrumentCompliance
from underskin.mechanisms.interface_slip import InterfaceSlip
from underskin.mechanisms.layered_contact import LayeredContact
from underskin.mechanisms.mains_pickup import MainsPickup
from underskin.mechanisms.mechanism import Mechanism
from underskin.mechanisms.misalignment import Misalignment
from underskin.mechanisms.modulus_error import ModulusError
from underskin.mechanisms.moving_contact_edge import MovingContactEdge
from underskin.mechanisms.platen_friction import PlatenFriction
from underskin.mechanisms.preload_dependent_d33 import PreloadDependentD33
from underskin.mechanisms.sensor_relaxation import SensorRelaxation
from underskin.mechanisms.sensor_spread import SensorSpread
from underskin.mechanisms.strain_stiffening import StrainStiffening
from underskin.mechanisms.thickness_error import ThicknessError
from underskin.mechanisms.timing_delay import TimingDelay

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
