"""Formulations for tests."""


def phase(mass_fraction: float, density_g_cm3: float, number_fractions: dict[float, float]) -> dict:
    """A phase as in the configuration, of size classes with these number fractions by diameter in um."""
    classes = [{"diameter_um": size, "number_fraction": share} for size, share in number_fractions.items()]
    return {"mass_fraction": mass_fraction, "density_g_cm3": density_g_cm3, "size_classes": classes}
