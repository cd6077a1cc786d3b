"""The ideal diagnosis of a fleet: it tells most of the skins that depart, and hardly ever another."""

import pytest

from proof.ideal_fleet import departures
from rig.joint import joint_campaigns


@pytest.mark.slow
def test_the_ideal_tells_who_departs_and_accuses_no_other() -> None:
    told, of, falsely = 0, 0, 0
    for number in range(12):
        joint = joint_campaigns(8, number, "skins")
        found = {skin for skin, probability in departures(joint).items() if probability > 0.5}
        departing = {joint.documents[hidden.documents[0]].skin for hidden in joint.hidden}
        falsely += bool(found - departing)
        of += len(departing)
        told += len(found & departing)
    assert of >= 5
    assert told >= of / 2
    assert falsely == 0
