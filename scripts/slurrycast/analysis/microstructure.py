"""Quantities of one structure, slurry or tape: densities, volume shares, contacts, percolation, pores, homogeneity.

docs/tape.md defines each of them.
"""

from collections.abc import Sequence
from itertools import combinations, product

import numpy as np

from slurrycast.analysis.coarseness import WINDOWS_UM, mixing_deviations, windows_fit
from slurrycast.analysis.percolation import percolating_shares
from slurrycast.analysis.pores import pore_sizes
from slurrycast.analysis.quantity_names import SUMS
from slurrycast.analysis.structure import Contacts, find_contacts, lens_volume_um3, structure_measures
from slurrycast.analysis.tortuosity import limit_of_fine_voxels, tortuosity
from slurrycast.analysis.voxels import VOID, voxel_image
from slurrycast.data.frames import Frame, Particles
from slurrycast.dem.recipe import sphere_volume_um3
from slurrycast.runtime.files import InputError

# A value and its unit, "1" for a number.
Quantities = dict[str, tuple[float, str]]

MOST_PARTICLES = 10_000  # whose void diffusion passes; of larger structures a layer is taken
MEDIA = ("void", "nonceramic")  # that diffusion passes: what no sphere fills, what no ceramic one does


def ceramic_phases(particles: Particles, organic: str) -> list[str]:
    """Names of the phases with particles, but for the organic one.

    InputError if that is no phase, if there is no other one, or one has a name that stands for several.
    """
    if organic not in particles.phase_names:
        raise InputError(f"organic phase {organic}: the particles are of {', '.join(particles.phase_names)}")
    ceramics = [name for name in particles.phase_names if name != organic and particles.in_phase(name).any()]
    if not ceramics:
        raise InputError(f"organic phase {organic}: there are no particles of another phase")
    for name in ceramics:
        if name in SUMS:
            raise InputError(f"phase {name}: {', '.join(SUMS)} are names of quantities of several phases")
    return ceramics


def _in_any(particles: Particles, names: Sequence[str]) -> np.ndarray:
    return np.any([particles.in_phase(name) for name in names], axis=0)


def _phase_shares(frame: Frame, particles: Particles, contacts: Contacts) -> dict[str, tuple[float, float]]:
    """Share of the box that each phase takes, by its name: nominal, and of the union of the spheres.

    The lens that two touching spheres share counts once, half of it for either (`packing_union`).
    """
    volume_um3 = sphere_volume_um3(2 * particles.radius_um)
    first, second = contacts.first, contacts.second
    lens_um3 = lens_volume_um3(contacts.distance_um, particles.radius_um[first], particles.radius_um[second])
    halves_um3 = np.bincount(np.concatenate([first, second]), np.tile(lens_um3 / 2, 2), minlength=len(particles))
    box_um3 = np.prod(frame.edges_um)
    masks = {name: particles.in_phase(name) for name in particles.phase_names}
    return {
        name: (float(volume_um3[mask].sum() / box_um3), float((volume_um3 - halves_um3)[mask].sum() / box_um3))
        for name, mask in masks.items()
    }


def _volume_shares(
    frame: Frame, particles: Particles, contacts: Contacts, ceramics: list[str], organic: str
) -> dict[str, float]:
    shares = _phase_shares(frame, particles, contacts)
    found = {}
    for place, kind in enumerate(("nominal", "union")):
        of_kind = {name: shares[name][place] for name in ceramics}
        of_kind |= {"ceramic": sum(of_kind.values()), "organic": shares[organic][place]}
        of_kind["void"] = 1 - of_kind["ceramic"] - of_kind["organic"]
        found |= {f"share_{name}_{kind}": share for name, share in of_kind.items()}
    # Organics that flow give way: the grains alone, without what organic spheres take of them.
    grains = _in_any(particles, ceramics)
    among = grains[contacts.first] & grains[contacts.second]
    contacts = Contacts(contacts.first[among], contacts.second[among], contacts.distance_um[among])
    without = _phase_shares(frame, particles, contacts)
    ceramic = sum(without[name][1] for name in ceramics)
    return found | {"share_ceramic_filled": ceramic, "share_nonceramic_filled": 1 - ceramic}


def _networks(frame: Frame, particles: Particles, contacts: Contacts, ceramics: list[str]) -> Quantities:
    """Contacts per volume and percolation of the ceramics."""
    masks = {name: particles.in_phase(name) for name in ceramics}
    grains = _in_any(particles, ceramics)
    touching = {"ceramic": grains[contacts.first] & grains[contacts.second]} | {
        f"{a}-{b}": masks[a][contacts.first] & masks[b][contacts.second]
        | masks[b][contacts.first] & masks[a][contacts.second]
        for a, b in combinations(ceramics, 2)
    }
    found = {
        f"contacts_{name}": (float(pairs.sum() / np.prod(frame.edges_um)), "1/um3") for name, pairs in touching.items()
    }
    for name, mask in (masks | {"ceramic": grains}).items():
        shares = percolating_shares(frame.position_um, frame.edges_um, contacts, mask)
        found |= {f"percolation_{name}_{axis}": (float(share), "1") for axis, share in zip("xyz", shares, strict=True)}
    return found


def microstructure(
    frame: Frame, particles: Particles, organic: str, solvent_mass_fraction: float, spacing_um: float
) -> tuple[Quantities, np.ndarray, dict[str, float]]:
    """Quantities of one structure by name, its voxel image, and the distribution of its pore sizes.

    Parameters
    ----------
    frame, particles
        The structure.
    organic
        Name of the phase that is no ceramic.
    solvent_mass_fraction
        Share of the mass of the organic phase that dries, 0 for a tape.
    spacing_um
        Edge of a voxel of the image, which the pore size is taken from.

    Returns
    -------
    tuple
        Values with their units; the codes (nx, ny, nz) of the phases in the order of the particles' `phase_names`,
        `VOID` between them (`voxel_image`); and `pore_sizes`, of which the values hold the mean, d10 and d90.

    Raises
    ------
    InputError
        If there are no particles of the organic phase's name or only of it (`ceramic_phases`), the box is too short
        (`find_contacts`), or there are too many voxels (`voxel_shape`).
    """
    ceramics = ceramic_phases(particles, organic)
    position_um, lower_um, edges_um = frame.position_um, frame.lower_um, frame.edges_um
    box = (lower_um, edges_um)
    box_um3 = float(np.prod(edges_um))
    contacts = find_contacts(position_um, *box, particles.radius_um)
    measures = structure_measures(position_um, *box, particles)
    solvent_pg = solvent_mass_fraction * particles.mass_pg[particles.in_phase(organic)].sum()
    found: Quantities = {
        "particles": (measures["particles"], "1"),
        "density": (measures["density_g_cm3"], "g/cm3"),
        "green_density": (measures["density_g_cm3"] - float(solvent_pg) / box_um3, "g/cm3"),
    }
    found |= {
        name: (share, "1") for name, share in _volume_shares(frame, particles, contacts, ceramics, organic).items()
    }
    found |= {name: (value, "1") for name, value in measures.items() if name.startswith("coordination_")}
    found |= _networks(frame, particles, contacts, ceramics)
    grains = _in_any(particles, ceramics)
    for window_um in WINDOWS_UM:
        if windows_fit(edges_um, particles.radius_um, window_um):
            deviations = mixing_deviations(position_um, *box, particles.radius_um, grains, window_um)
            names = (f"ceramic_share_sd_{window_um:g}um", f"ceramic_share_sd_random_{window_um:g}um")
            found |= {name: (deviation, "1") for name, deviation in zip(names, deviations, strict=True)}
    image = voxel_image(position_um, *box, particles.radius_um, particles.phase, spacing_um)
    sizes = pore_sizes(image == VOID, edges_um / image.shape)
    found["voxel_spacing"] = (spacing_um, "um")
    found |= {f"pore_size_{name}": (sizes[name], "um") for name in ("mean", "d10", "d90")}
    return found, image, sizes


def void_tortuosity(
    frame: Frame, particles: Particles, spacing_um: float, axis: str = "z", solid: np.ndarray | None = None
) -> float:
    """Tortuosity factor of what is void between particles.

    Of a structure of n > `MOST_PARTICLES` the middle layer across the axis is taken, `MOST_PARTICLES` / n as thick and
    as wide as the box, so that its sides stay periodic.

    Parameters
    ----------
    frame, particles
        The structure.
    spacing_um
        Edge of a voxel.
    axis
        Direction of the diffusion: x, y or z. The sides along the other two are periodic.
    solid
        Mask (n,) of the particles that it does not pass; all by default.

    Returns
    -------
    The factor, or NaN if no way leads through.

    Raises
    ------
    InputError
        If there are too many voxels (`voxel_shape`).
    RunError
        If the diffusion does not converge.
    """
    solid = np.ones(len(particles), dtype=bool) if solid is None else solid
    box = (frame.lower_um, frame.edges_um)
    image = voxel_image(frame.position_um[solid], *box, particles.radius_um[solid], particles.phase[solid], spacing_um)
    order = sorted(range(3), key=lambda number: "xyz"[number] == axis)  # the axis last
    void, spacing = (image == VOID).transpose(order), (frame.edges_um / image.shape)[order]
    layers = void.shape[2]
    taken = max(1, round(layers * min(1.0, MOST_PARTICLES / len(particles))))
    start = (layers - taken) // 2
    return tortuosity(void[:, :, start : start + taken], spacing)


def tortuosities(
    frame: Frame,
    particles: Particles,
    organic: str,
    spacings_um: Sequence[float],
    axes: Sequence[str] = ("z",),
    media: Sequence[str] = ("void",),
    with_limit: bool = False,
) -> Quantities:
    """Tortuosity factors of one structure by name, such as tortuosity_z_0.1um; NaN if no way leads through.

    Parameters
    ----------
    frame, particles, organic
        The structure, and the phase that is no ceramic.
    spacings_um, axes
        Edges of the voxels, and directions of the diffusion: x, y, z.
    media
        What it passes: of `MEDIA`.
    with_limit
        Whether to add the values for voxels of edge 0, `limit_of_fine_voxels`.

    Raises
    ------
    InputError, RunError
        As `ceramic_phases`, `void_tortuosity` and `limit_of_fine_voxels`.
    """
    solids = {"void": None, "nonceramic": _in_any(particles, ceramic_phases(particles, organic))}
    found: Quantities = {}
    for medium, axis in product(media, axes):
        start = f"tortuosity_{axis}" if medium == "void" else f"tortuosity_{medium}_{axis}"
        factors = [void_tortuosity(frame, particles, spacing, axis, solids[medium]) for spacing in spacings_um]
        found |= {f"{start}_{h:g}um": (factor, "1") for h, factor in zip(spacings_um, factors, strict=True)}
        if with_limit:
            found[f"{start}_extrapolated"] = (limit_of_fine_voxels(spacings_um, factors), "1")
    return found
