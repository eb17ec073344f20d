"""Microstructures in 3D, side by side: spheres at true size coloured by phase, box outline, thickness Lz, one scale.

PyVista renders without a display, in a child process: where VTK finds no way to render it may end the whole process.
Flat circles drawn by Matplotlib in the same projection then take the place of the spheres.
"""

import multiprocessing
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import EllipseCollection, LineCollection
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.image import imread

from slurrycast.data.frames import Particles, read_frames
from slurrycast.data.periodic import wrap
from slurrycast.report.figures import INK, new_figure, phase_colours, phase_handles, save_figure

AZIMUTH_DEG, ELEVATION_DEG = 30.0, 14.0
PIXELS_PER_UM, MAX_PIXELS = 40, 900
TIMEOUT_S = 900
BOX_CORNERS = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
BOX_EDGES = [(i, j) for i in range(8) for j in range(i) if np.abs(BOX_CORNERS[i] - BOX_CORNERS[j]).sum() == 1]


@dataclass(frozen=True)
class Structure:
    """One microstructure in the coordinates of its picture: wrapped `position_um` (n, 3), and the box in um, (3,)."""

    title: str
    particles: Particles
    position_um: np.ndarray
    lower_um: np.ndarray
    edges_um: np.ndarray

    @property
    def corners_um(self) -> np.ndarray:
        """Corners of the box, (8, 3) in um."""
        return self.lower_um + BOX_CORNERS * self.edges_um


def read_structure(path: Path, title: str, frame: int | None = None) -> Structure:
    """Read a frame (default: the last one) and wrap it into its box, whose centre is that of the picture."""
    with read_frames(path) as store:
        frame = store.last if frame is None else frame
        lower_um, edges_um = store.box(frame)
        position_um = wrap(store.position_um(frame), lower_um, edges_um) - (lower_um + edges_um / 2)
        return Structure(title, store.particles, position_um, -edges_um / 2, edges_um)


def on_one_level(structures: Sequence[Structure]) -> list[Structure]:
    """Move structures along z until their boxes stand as low as the lowest of them."""
    level_um = min(structure.lower_um[2] for structure in structures)
    moved = []
    for structure in structures:
        shift_um = np.array([0.0, 0.0, level_um - structure.lower_um[2]])
        lower_um, position_um = structure.lower_um + shift_um, structure.position_um + shift_um
        moved.append(replace(structure, lower_um=lower_um, position_um=position_um))
    return moved


def view_axes() -> np.ndarray:
    """Rows: unit vectors (3, 3) to the right and up in the picture, and towards the viewer; parallel projection."""
    azimuth, elevation = np.radians([AZIMUTH_DEG, ELEVATION_DEG])
    towards = np.array([np.cos(elevation) * np.sin(azimuth), -np.cos(elevation) * np.cos(azimuth), np.sin(elevation)])
    right = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
    return np.array([right, np.cross(towards, right), towards])


def half_size_um(structures: Sequence[Structure]) -> np.ndarray:
    """Half width and half height (2,) in um of a picture that holds each box with the spheres at its faces."""
    corners = np.concatenate([structure.corners_um for structure in structures])
    radius_um = max(structure.particles.radius_um.max() for structure in structures)
    return np.abs(corners @ view_axes()[:2].T).max(axis=0) + radius_um


def corners_of_circle(radius_pixels: float) -> int:
    """Number of corners of a polygon within half a pixel of a circle; of 35000 spheres, more would take GBs."""
    return max(8, int(np.ceil(np.pi / np.arccos(max(0.0, 1 - 0.5 / radius_pixels)))))


def render_with_pyvista(structures: Sequence[Structure], half_um: np.ndarray, paths: Sequence[Path]) -> None:
    """Write one picture of each structure, all of the same size and scale."""
    import pyvista

    _, up, towards = view_axes()
    pixels_per_um = min(PIXELS_PER_UM, MAX_PIXELS / (2 * half_um.max()))
    window = [round(2 * half * pixels_per_um) for half in half_um]
    widest_um = max(structure.particles.radius_um.max() for structure in structures)
    corners = corners_of_circle(widest_um * pixels_per_um)
    sphere = pyvista.Sphere(radius=1.0, theta_resolution=corners, phi_resolution=corners)
    for structure, path in zip(structures, paths, strict=True):
        plotter = pyvista.Plotter(off_screen=True, window_size=window)
        plotter.set_background("white")
        names = structure.particles.phase_names
        for name, colour in zip(names, phase_colours(names), strict=True):
            of_phase = structure.particles.in_phase(name)
            if of_phase.any():
                points = pyvista.PolyData(structure.position_um[of_phase])
                points["radius_um"] = structure.particles.radius_um[of_phase]
                glyphs = points.glyph(geom=sphere, scale="radius_um", orient=False)
                plotter.add_mesh(glyphs, color=colour, smooth_shading=True, ambient=0.25, specular=0.15)
        corners_um = structure.corners_um
        box = pyvista.Box(np.stack([corners_um[0], corners_um[-1]], axis=1).ravel())
        plotter.add_mesh(box.outline().tube(radius=0.0025 * half_um[1]), color=INK, lighting=False)
        plotter.camera.parallel_projection = True
        plotter.camera.focal_point = (0.0, 0.0, 0.0)
        plotter.camera.position = 10 * np.linalg.norm(half_um) * towards
        plotter.camera.up = up
        plotter.camera.parallel_scale = half_um[1]
        plotter.reset_camera_clipping_range()
        plotter.enable_anti_aliasing("ssaa")
        plotter.screenshot(path)
        plotter.close()


def rendered_by_child(structures: Sequence[Structure], half_um: np.ndarray, paths: Sequence[Path]) -> bool:
    """Run `render_with_pyvista` in a child process and tell whether all pictures are there."""
    child = multiprocessing.get_context("spawn").Process(target=render_with_pyvista, args=(structures, half_um, paths))
    child.start()
    child.join(TIMEOUT_S)
    if child.exitcode is None:
        child.kill()
        child.join()
    return child.exitcode == 0 and all(path.is_file() for path in paths)


def draw_circles(axes: Axes, structure: Structure) -> None:
    """Draw the particles as circles from back to front, darker at the back, and the outline of the box."""
    horizontal, vertical, depth = view_axes() @ structure.position_um.T
    order = np.argsort(depth)
    light = np.interp(depth, (depth.min(), depth.max()), (0.55, 1.0))[:, None]
    names = structure.particles.phase_names
    colours = np.array([to_rgb(colour) for colour in phase_colours(names)])[structure.particles.phase - 1]
    diameter_um = 2 * structure.particles.radius_um[order]
    places = {"offsets": np.column_stack([horizontal, vertical])[order], "transOffset": axes.transData}
    style = {"facecolors": (colours * light)[order], "edgecolors": INK, "linewidths": 0.25}
    circles = EllipseCollection(diameter_um, diameter_um, np.zeros(len(order)), units="xy", **places, **style)
    axes.add_collection(circles)
    corners = structure.corners_um @ view_axes()[:2].T
    axes.add_collection(LineCollection([corners[list(edge)] for edge in BOX_EDGES], colors=INK, linewidths=0.8))


def mark_thickness(axes: Axes, structure: Structure) -> None:
    """Draw a dimension line for Lz along the box edge at the left."""
    corners = structure.corners_um @ view_axes()[:2].T
    left = corners[:, 0].min()
    low, high = np.sort(corners[np.isclose(corners[:, 0], left), 1])
    place = left - 1.6 * structure.particles.radius_um.max()
    arrow = {"arrowstyle": "<->", "color": INK, "shrinkA": 0, "shrinkB": 0, "lw": 1.1}
    axes.annotate("", (place, low), (place, high), arrowprops=arrow, annotation_clip=False)
    text = f"$L_z$ = {structure.edges_um[2]:.2f} µm\n"
    axes.text(place, (low + high) / 2, text, rotation=90, ha="right", va="center")


def draw_structures(structures: Sequence[Structure], pictures: Sequence[Path] | None) -> Figure:
    """Place the pictures side by side (None: draw circles), each with its thickness."""
    half_um = half_size_um(structures)
    margin_um = 3.2 * max(s.particles.radius_um.max() for s in structures) + 0.06 * half_um[1]
    shape = (2 * half_um[0] + margin_um) / (2 * half_um[1])
    height_in = min(4.6, 10 / (max(3, len(structures)) * shape))
    width_in = height_in * shape
    figure = new_figure(width_in * len(structures) + 0.2, height_in + 0.75)
    panels = figure.subplots(1, len(structures), squeeze=False)[0]
    for index, (axes, structure) in enumerate(zip(panels, structures, strict=True)):
        extent = (-half_um[0], half_um[0], -half_um[1], half_um[1])
        if pictures is None:
            draw_circles(axes, structure)
        else:
            axes.imshow(imread(pictures[index]), extent=extent, interpolation="antialiased")
        axes.set(xlim=(extent[0] - margin_um, extent[1]), ylim=extent[2:], aspect="equal", title=structure.title)
        axes.axis("off")
        mark_thickness(axes, structure)
    handles = phase_handles(structures[0].particles.phase_names, 9)
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles), fontsize=10)
    return figure


def render(structures: Sequence[Structure], path: Path) -> None:
    """Write a figure (PNG) of the structures from left to right, rendered where that is possible."""
    with tempfile.TemporaryDirectory() as folder:
        pictures = [Path(folder) / f"{index}.png" for index in range(len(structures))]
        if not rendered_by_child(structures, half_size_um(structures), pictures):
            print("PyVista cannot render here: drawing circles with Matplotlib instead", file=sys.stderr)
            pictures = None
        save_figure(draw_structures(structures, pictures), path, colours=256)
