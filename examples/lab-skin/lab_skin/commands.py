"""The command `underskin hertz`."""


def hertz(force_n: float, radius_mm: float, modulus_mpa: float) -> None:
    """The Hertz contact radius of a sphere on an incompressible half space."""
    print(f"{(3 * force_n * radius_mm * 0.75 / (4 * modulus_mpa)) ** (1 / 3):.3f} mm")
