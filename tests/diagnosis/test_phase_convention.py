"""Which sign convention the phases of FRFs have."""

import numpy as np

from underskin.diagnosis.screening.phase_convention import in_one_convention
from underskin.recordings.campaign import FrfRecording


def test_phases_of_a_few_milliradians_are_no_other_convention() -> None:
    """Noise alone aligns signs as well as a phase does, where a channel's phase noise is larger than is stated."""
    random = np.random.default_rng(5)
    frequency = np.geomspace(1.0, 130.0, 40)
    entries = [
        FrfRecording(
            f"r{number}",
            "s01",
            4.0,
            1.0,
            0.09,
            frequency_hz=frequency,
            frf_re_pc_per_n=7.0 * (1 + 0.001 * random.normal(size=40)),
            frf_im_pc_per_n=7.0 * 0.004 * (-1) ** (number == 0) * np.ones(40) + 0.002 * random.normal(size=40),
        )
        for number in range(6)
    ]
    turned, findings = in_one_convention(entries)
    assert findings == []
    assert all(one is other for one, other in zip(turned, entries, strict=True))
