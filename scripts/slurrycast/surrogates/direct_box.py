"""No DEM of the slurry, but its final box: random places in the box that the training slurries tell."""

from slurrycast.surrogates.affine import Affine


class DirectBox(Affine):
    """The affine map of random places in the first box."""

    name = "direct_box"
    looks_at = "nothing but the recipe and the final box"
    from_recipe = True
