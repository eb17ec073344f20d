"""Measure the microstructure of one slurry or tape.

In: a frame store (HDF5), whose last frame is measured, and the JSON of generate_inputs.py of its slurry.
Out: a table (CSV) of source (dem or a surrogate), slurry, stage (slurry or tape), quantity, value and unit; on demand a
table of the volume share of each phase and the void along z (z_um is the centre of a layer of voxels, from the lower
face), one of the distribution of pore sizes (share_below, of the void, and diameter_um), a file with what models of
cells ask for (JSON), and the voxel image (HDF5: phase (x, y, z), 0 for void). docs/tape.md defines the quantities. One
that does not exist, such as the tortuosity of a void without a way through, is empty; one whose windows do not fit into
the box is left out.
"""

import argparse
import json
import math
from collections.abc import Callable, Mapping

import numpy as np
import pandas as pd

from slurrycast.analysis.microstructure import MEDIA, Quantities, ceramic_phases, microstructure, tortuosities
from slurrycast.analysis.tortuosity import LEAST_SPACINGS
from slurrycast.analysis.voxels import phase_shares, write_voxels
from slurrycast.data.frames import Frame, Particles, read_frames
from slurrycast.data.tables import write_table
from slurrycast.dem.relaxation import check_slurry
from slurrycast.runtime.command_line import Namespace, Parser, run_main
from slurrycast.runtime.costs import measured_cost
from slurrycast.runtime.files import write_text

FINEST_UM, COARSEST_UM = 0.001, 5.0  # of voxels


def number_within(lowest: float, highest: float) -> Callable[[str], float]:
    """Type of an option: a number from `lowest` to `highest`."""

    def number(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not lowest <= value <= highest:
            raise argparse.ArgumentTypeError(f"{text}: must be {lowest:g} to {highest:g}")
        return value

    return number


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_input("--structure", "frames of a slurry or tape (HDF5)")
    parser.add_input("--inputs", "JSON of generate_inputs.py")
    parser.add_value("--organic", "phase that is no ceramic", default="BDPD")
    parser.add_value("--solvent-mass-fraction", "of the organic phase, 0 if dry", type=number_within(0, 1), default=0.0)
    parser.add_value("--wet-thickness-um", "of the cast film that a tape is of, um", type=float, required=False)
    parser.add_value(
        "--spacing-um", "voxels of image and pore size, um", type=number_within(FINEST_UM, COARSEST_UM), default=0.1
    )
    parser.add_value(
        "--tortuosity-spacings-um",
        "voxels of the tortuosity, um; none: it is not computed",
        type=number_within(FINEST_UM, COARSEST_UM),
        nargs="*",
        default=[],
    )
    parser.add_value(
        "--tortuosity-axes", "directions of its diffusion", nargs="+", choices=["x", "y", "z"], default=["z"]
    )
    parser.add_value(
        "--tortuosity-of", "what it passes; nonceramic: void and organics", nargs="+", choices=MEDIA, default=["void"]
    )
    parser.add_value("--tortuosity-extrapolated", "to voxels of edge 0 too", action="store_true", default=False)
    parser.add_output("--table", "quantities (CSV)")
    parser.add_output("--profile", "shares along z (CSV)", required=False)
    parser.add_output("--pores", "distribution of the pore size (CSV)", required=False)
    parser.add_output("--properties", "what models of cells ask for (JSON)", required=False)
    parser.add_output("--voxels", "voxel image (HDF5)", required=False)
    parser.add_output("--cost", "cost record (JSON)")
    parser.add_check(too_few_spacings)


def too_few_spacings(args: Namespace) -> str | None:
    """What is wrong with the spacings, if anything is."""
    enough = not args.tortuosity_extrapolated or len(set(args.tortuosity_spacings_um)) >= LEAST_SPACINGS
    return None if enough else f"--tortuosity-extrapolated needs {LEAST_SPACINGS} --tortuosity-spacings-um or more"


def thickness(attributes: Mapping, wet_thickness_um: float | None) -> Quantities:
    """How much thinner a tape is than its slurry, and its thickness if that of the cast film is known."""
    ratio = float(attributes["tape_thickness_um"] / attributes["slurry_thickness_um"])
    found: Quantities = {"shrinkage": (1 - ratio, "1")}
    return found | ({"thickness": (ratio * wet_thickness_um, "um")} if wet_thickness_um else {})


def profile(image: np.ndarray, frame: Frame, particles: Particles) -> pd.DataFrame:
    """Table of the share of each phase and the void in each layer of voxels along z."""
    layers = image.shape[2]
    z_um = (np.arange(layers) + 0.5) * frame.edges_um[2] / layers
    shares = phase_shares(image, len(particles.phase_names))
    names = ("void", *particles.phase_names)
    tables = [
        pd.DataFrame({"z_um": z_um, "phase": name, "share": row}) for name, row in zip(names, shares, strict=True)
    ]
    return pd.concat(tables)


def properties(quantities: Quantities, frame: Frame, particles: Particles, organic: str) -> dict:
    """What models of cells ask for, by name; None for what does not exist or is not known."""
    values = {name: None if math.isnan(value) else value for name, (value, _) in quantities.items()}

    def named(start: str, end: str = "") -> dict:
        return {
            name.removeprefix(start).removesuffix(end): value
            for name, value in values.items()
            if name.startswith(start) and name.endswith(end)
        }

    masks = {name: particles.in_phase(name) for name in particles.phase_names}
    shares, ceramics = named("share_", "_union"), ceramic_phases(particles, organic)
    ceramic_particles = sum(masks[name].sum() for name in ceramics)
    contacts = values["contacts_ceramic"] * np.prod(frame.edges_um)
    return {
        "box_edges_um": frame.edges_um.tolist(),
        "thickness_um": values.get("thickness"),
        "density_g_cm3": values["density"],
        "green_density_g_cm3": values["green_density"],
        "porosity": values["share_void_union"],
        "porosity_without_organics": values["share_nonceramic_filled"],
        "volume_shares": shares,
        "shares_of_ceramic_volume": {name: shares[name] / shares["ceramic"] for name in ceramics},
        "mean_radius_um": {name: float(particles.radius_um[m].mean()) for name, m in masks.items() if m.any()},
        "coordination": named("coordination_") | {"ceramic": float(2 * contacts / ceramic_particles)},
        "contacts_per_um3": named("contacts_"),
        "percolation": named("percolation_"),
        "pore_diameter_um": named("pore_size_"),
        "pore_diameter_voxel_um": values["voxel_spacing"],
        "tortuosity_factor_of_void": {
            name: value for name, value in named("tortuosity_").items() if not name.startswith("nonceramic_")
        },
        "tortuosity_factor_without_organics": named("tortuosity_nonceramic_"),
    }


def main(args: Namespace) -> None:
    """Measure the structure and write the files that are asked for."""
    inputs = json.loads(args.inputs.read_text(encoding="utf-8"))
    with read_frames(args.structure) as store:
        check_slurry(store, inputs)
        frame, particles = store.frame(store.last), store.particles
    attributes = store.attributes
    source, stage = attributes.get("surrogate"), "tape" if "tape_thickness_um" in attributes else "slurry"
    names = {"source": source or "dem", "slurry": inputs["slurry"], "stage": stage}
    with measured_cost(args.cost, "measure_microstructure", source or "-", inputs["slurry"]) as cost:
        cost.particles = len(particles)
        quantities, image, pores = microstructure(
            frame, particles, args.organic, args.solvent_mass_fraction, args.spacing_um
        )
        if stage == "tape":
            quantities |= thickness(attributes, args.wet_thickness_um)
        along, of, limit = args.tortuosity_axes, args.tortuosity_of, args.tortuosity_extrapolated
        quantities |= tortuosities(frame, particles, args.organic, args.tortuosity_spacings_um, along, of, limit)
        rows = [names | {"quantity": name, "value": value, "unit": unit} for name, (value, unit) in quantities.items()]
        write_table(args.table, rows)
        if args.profile:
            write_table(args.profile, profile(image, frame, particles))
        if args.pores:
            shares = [
                {"share_below": int(name[1:]) / 100, "diameter_um": size} for name, size in list(pores.items())[1:]
            ]
            write_table(args.pores, shares)
        if args.properties:
            cell = properties(quantities, frame, particles, args.organic)
            write_text(args.properties, json.dumps(cell, indent=1) + "\n")
        if args.voxels:
            write_voxels(args.voxels, image, frame.edges_um, particles.phase_names)


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
