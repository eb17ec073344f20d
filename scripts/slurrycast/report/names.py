"""Names of the tables' quantities, pairs and columns, with their units, as figures and pages show them."""

from typing import NamedTuple

from slurrycast.analysis.training_range import DENSITY_PREFIX, FRACTION_PREFIX, RADIUS_PREFIX
from slurrycast.evaluation.verdicts import MEASURES, group_of

QUANTITY_NAMES = {
    "density_g_cm3": "density (g/cm³)",
    "share_below_4_contacts": "share with fewer than 4 contacts",
    "overlap_mean": "mean overlap",
    "overlap_max": "largest overlap",
    "packing_nominal": "packing fraction, nominal",
    "packing_union": "packing fraction, union",
    "perturbation_floor_um2": "perturbation floor (µm²)",
}
UNITS = {"um2": "µm²", "um": "µm", "us": "µs", "s": "s", "min": "min", "g_cm3": "g/cm³"}


class RangeQuantity(NamedTuple):
    """A quantity of tables/training_range.csv: its column, how a sentence names and ends a value, and its format."""

    column: str
    before: str
    unit: str
    form: str


RANGE_QUANTITIES = {
    "particles": RangeQuantity("Particles", "", " particles", ",.0f"),
    "shortest_edge_um": RangeQuantity("Shortest edge (µm)", "shortest box edge ", " µm", ".4g"),
    "longest_edge_um": RangeQuantity("Longest edge (µm)", "longest box edge ", " µm", ".4g"),
    "density_g_cm3": RangeQuantity("Density (g/cm³)", "density at the last input frame ", " g/cm³", ".5g"),
    "thickness_ratio": RangeQuantity("Lz/Lx", "Lz/Lx ", "", ".4g"),
    "mean_radius_um": RangeQuantity("Mean radius (µm)", "mean particle radius ", " µm", ".4g"),
}


RANGE_QUANTITIES_OF_PHASES = {
    FRACTION_PREFIX: RangeQuantity("Number fraction, {}", "number fraction of {} ", "", ".4f"),
    RADIUS_PREFIX: RangeQuantity("Mean radius, {} (µm)", "mean particle radius of {} ", " µm", ".4g"),
    DENSITY_PREFIX: RangeQuantity("Density of {} (g/cm³)", "density of {} ", " g/cm³", ".5g"),
}


def range_quantity(quantity: str) -> RangeQuantity:
    """Name and format of a quantity of tables/training_range.csv; phases are those of the recipe."""
    for prefix, (column, before, unit, form) in RANGE_QUANTITIES_OF_PHASES.items():
        if quantity.startswith(prefix):
            phase = quantity.removeprefix(prefix)
            return RangeQuantity(column.format(phase), before.format(phase), unit, form)
    return RANGE_QUANTITIES[quantity]


def source_name(source: str) -> str:
    """Name of where a tape comes from: "DEM" of `dem`, or the label of a surrogate."""
    return "DEM" if source == "dem" else source


def pair_name(pair: str) -> str:
    """Name of an RDF's pair in sentences and tables."""
    return "all particles" if pair == "all" else pair


def quantity_name(quantity: str) -> str:
    """Name of a structural quantity: "RDF, NiO-8YSZ" of `rdf_NiO-8YSZ`."""
    kind, _, pair = quantity.partition("_")
    if kind == "coarseness":
        window, _, phase = pair.partition("_")
        return f"coarseness, {phase}, {window.removesuffix('um')} µm"
    kinds = {"rdf": "RDF", "coordination": "coordination"}
    return f"{kinds[kind]}, {pair_name(pair)}" if kind in kinds else QUANTITY_NAMES.get(quantity, quantity)


def measure_name(measure: str) -> str:
    """Short name of a judged measure without its unit: all are in units of the noise."""
    if group_of(measure) not in MEASURES:
        return tape_quantity(measure, "1")
    return quantity_name(measure).removesuffix(" (g/cm³)").removeprefix("share with ")


TAPE_NAMES = {
    "green_density": "green density",
    "shrinkage": "shrinkage of the thickness",
    "thickness": "thickness",
    "share_ceramic_union": "ceramic share",
    "share_organic_union": "organic share",
    "share_void_union": "void",
    "share_ceramic_filled": "ceramic share, organics in the void",
    "share_nonceramic_filled": "all but ceramic",
    "contacts_ceramic": "contacts between ceramics",
}


def tape_quantity(quantity: str, unit: str) -> str:
    """Name of a quantity of tables/microstructure.csv with its unit."""
    kind, _, rest = quantity.partition("_")
    if quantity in TAPE_NAMES:
        name = TAPE_NAMES[quantity]
    elif quantity.startswith("pore_size_"):
        name = f"pore size, {quantity.removeprefix('pore_size_')}"
    elif quantity.startswith("ceramic_share_sd_"):
        random, _, window = quantity.removeprefix("ceramic_share_sd_").rpartition("_")
        name = f"sd of the ceramic share in {window.removesuffix('um')} µm" + (", random mixture" if random else "")
    elif kind == "tortuosity":
        *medium, axis, voxels = rest.split("_")
        passed = "void and organics" if medium else "void"
        grid = voxels if voxels == "extrapolated" else f"{voxels.removesuffix('um')} µm voxels"
        name = f"tortuosity factor of {passed}, {axis}, {grid}"
    elif kind == "percolation":
        phase, _, axis = rest.rpartition("_")
        name = f"percolation, {phase} along {axis}"
    else:
        name = f"{kind}, {pair_name(rest)}"
    units = {"1": "", "g/cm3": " (g/cm³)", "1/um3": " (1/µm³)", "um": " (µm)"}
    return name + units.get(unit, f" ({unit})")


INPUT_KINDS = {"mass_fraction": "mass fraction", "size_factor": "size factor", "density_g_cm3": "density (g/cm³)"}


def input_name(column: str) -> str:
    """Name of an input of the recipes of an exploration: "NiO size factor" of `size_factor_NiO`."""
    for kind, name in INPUT_KINDS.items():
        if column.startswith(f"{kind}_"):
            return f"{column.removeprefix(f'{kind}_')} {name}"
    return column_name(column)


def column_name(column: str) -> str:
    """Name of a table's column with its unit in brackets: "validation mse (µm²)" of `validation_mse_um2`."""
    for ending, unit in UNITS.items():
        if column.endswith(f"_{ending}"):
            return f"{column.removesuffix(f'_{ending}').replace('_', ' ')} ({unit})"
    return column.replace("_", " ")
