"""All mechanisms by name, in the order in which a model composes them."""

from underskin.mechanisms.amplifier_high_pass import AmplifierHighPass
from underskin.mechanisms.mechanism import Mechanism
from underskin.mechanisms.moving_contact_edge import MovingContactEdge
from underskin.mechanisms.timing_delay import TimingDelay

CATALOGUE: dict[str, Mechanism] = {
    mechanism.name: mechanism
    for mechanism in (
        MovingContactEdge(),
        AmplifierHighPass(),
        TimingDelay(),
    )
}
