"""Tortuosity factor of a phase of a voxel image: steady-state diffusion between the two faces along z.

Fick's law on the voxels of the phase, finite differences between the centres of neighbours: concentration 1 on the
lower face and 0 on the upper one, no flux into other phases, periodic along x and y. The tortuosity factor is

    tau = eps D0 / Deff

with eps the volume share of the phase, isolated parts included, and Deff = (flux per area) thickness / (difference of
concentration). A phase of straight channels along z has tau = 1 (Cooper et al., SoftwareX 5, 203, 2016).
"""

from collections.abc import Sequence

import numpy as np
from numpy.polynomial import Polynomial

from slurrycast.runtime.files import InputError, RunError

_TOLERANCE = 1e-6  # of the residual; the flux is taken from the dissipation, whose error is of second order
_MOST_ITERATIONS = 20_000
_BLOCK = 6  # edge in voxels of the blocks of the coarse problem
LEAST_SPACINGS = 3  # of an extrapolation: two would always lie on a line


def conducting(phase: np.ndarray) -> np.ndarray:
    """Voxels (nx, ny, nz) of a phase, a mask of the same shape, that are connected with both faces along z."""
    from scipy.ndimage import label
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    part, count = label(phase)
    # Parts that meet across the periodic faces are one.
    faces = [(part[0], part[-1]), (part[:, 0], part[:, -1])]
    one, other = (np.concatenate([face[side].ravel() for face in faces]) for side in (0, 1))
    meet = (one > 0) & (other > 0)
    links = coo_array((np.ones(meet.sum()), (one[meet], other[meet])), shape=(count + 1, count + 1))
    part = connected_components(links, directed=False)[1][part]
    lower, upper = (part[:, :, end][phase[:, :, end]] for end in (0, -1))
    return phase & np.isin(part, np.intersect1d(lower, upper))


def tortuosity(phase: np.ndarray, spacing_um: np.ndarray) -> float:
    """Tortuosity factor of a phase along z.

    Parameters
    ----------
    phase
        Mask (nx, ny, nz) of its voxels.
    spacing_um
        Edges (3,) of a voxel in um.

    Returns
    -------
    tau, or NaN if the phase does not connect the two faces.

    Raises
    ------
    RunError
        If the conjugate gradients do not converge.
    """
    from scipy.sparse.linalg import LinearOperator, cg

    inside = conducting(phase)
    if not inside.any():
        return float("nan")
    matrix, inflow = _equations(inside, spacing_um)
    guess = 1 - (np.nonzero(inside)[2] + 0.5) / inside.shape[2]
    solve = LinearOperator(matrix.shape, _preconditioner(matrix, inside))
    found, failed = cg(matrix, inflow, guess, rtol=_TOLERANCE, maxiter=_MOST_ITERATIONS, M=solve)
    if failed:
        raise RunError(f"diffusion through {len(guess)} voxels: not converged in {_MOST_ITERATIONS} iterations")
    flux = found @ (matrix @ found - 2 * inflow) + inflow.sum()
    width_um, depth_um, height_um = spacing_um * inside.shape
    return float(phase.mean() * width_um * depth_um / height_um / flux)


def limit_of_fine_voxels(spacings_um: Sequence[float], factors: Sequence[float]) -> float:
    """Tortuosity factor for voxels of edge 0: a line fitted to the factors over the spacings, at 0.

    NaN if one of the factors is, or if the line ends below 1, as no factor can: the spacings are too coarse for one.
    InputError for fewer than `LEAST_SPACINGS` different spacings.
    """
    if len(set(spacings_um)) < LEAST_SPACINGS:
        raise InputError(f"voxels of {len(set(spacings_um))} spacings: at least {LEAST_SPACINGS} are needed")
    if np.isnan(factors).any():
        return float("nan")
    limit = float(Polynomial.fit(spacings_um, factors, 1)(0.0))
    return limit if limit >= 1 else float("nan")


def _equations(inside: np.ndarray, spacing_um: np.ndarray):
    """Matrix of the conductances between n voxels, and the inflow (n,) at the lower face."""
    from scipy.sparse import coo_array, dia_array

    count = int(inside.sum())
    number = np.full(inside.shape, -1, dtype=np.int32)
    number[inside] = np.arange(count, dtype=np.int32)
    conductance = spacing_um.prod() / spacing_um**2
    rows, columns, values, diagonal = [], [], [], np.zeros(count)
    for axis in range(3):
        neighbour = np.roll(number, -1, axis=axis)
        if axis == 2:
            neighbour[:, :, -1] = -1
        linked = (number >= 0) & (neighbour >= 0)
        one, other = number[linked], neighbour[linked]
        rows += [one, other]
        columns += [other, one]
        values.append(np.full(2 * len(one), -conductance[axis]))
        diagonal += conductance[axis] * np.bincount(np.concatenate([one, other]), minlength=count)
    inflow = np.zeros(count)
    for end in (0, -1):
        at_face = number[:, :, end][inside[:, :, end]]
        diagonal[at_face] += 2 * conductance[2]  # half a voxel from its centre to the face
        if end == 0:
            inflow[at_face] = 2 * conductance[2]
    links = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    matrix = coo_array(links, shape=(count, count)).tocsr() + dia_array((diagonal[None], [0]), shape=(count, count))
    return matrix.tocsr(), inflow


def _preconditioner(matrix, inside: np.ndarray):
    """Function that solves the equations about, for conjugate gradients.

    The diagonal settles each voxel among its neighbours. The same equations for blocks of voxels of one concentration
    each, solved exactly, settle what is slow: differences over long distances.
    """
    from scipy.sparse import csr_array
    from scipy.sparse.linalg import splu

    counts = -(-np.array(inside.shape) // _BLOCK)
    index = np.ravel_multi_index(tuple(axis // _BLOCK for axis in np.nonzero(inside)), counts)
    used, block = np.unique(index, return_inverse=True)
    gather = csr_array((np.ones(len(block)), block, np.arange(len(block) + 1)), shape=(len(block), len(used)))
    coarse = splu((gather.T @ matrix @ gather).tocsc())
    diagonal = matrix.diagonal()
    spread = gather.T.tocsr()
    return lambda residual: residual / diagonal + coarse.solve(spread @ residual)[block]
