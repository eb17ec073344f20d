"""Find the friction of the drying at which a tape has a measured green density, by bisection.

In: an equilibrated slurry (HDF5, its last frame), the inputs of its DEM, the settings of the drying, and the density.
Out: a table (CSV) of one row a drying: friction and green_density_g_cm3, the last row nearest to the measured one. The
density falls with friction. Friction is halved on a logarithmic scale between --least and --most until the density is
within --tolerance, a share of it, or --dryings have been made. A density beyond both ends is refused by its range.
"""

import json
from pathlib import Path

from slurrycast.data.frames import read_frames
from slurrycast.data.tables import write_table
from slurrycast.dem.calibration import bisection
from slurrycast.dem.drying_run import dry
from slurrycast.dem.lammps_run import Launcher
from slurrycast.runtime.command_line import Namespace, Parser, run_main
from slurrycast.runtime.work_folder import work_folder


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_input("--structure", "equilibrated slurry, HDF5")
    parser.add_input("--inputs", "JSON of generate_inputs.py")
    parser.add_value("--settings", "JSON, as for dry_slurry", type=json.loads)
    parser.add_value("--green-density-g-cm3", "measured green density", type=float)
    parser.add_value("--least", "least friction", type=float, default=0.01)
    parser.add_value("--most", "greatest friction", type=float, default=10.0)
    parser.add_value("--tolerance", "share of the density that is near enough", type=float, default=0.003)
    parser.add_value("--dryings", "number of dryings at most", type=int, default=9)
    parser.add_value("--work", "work folder; kept with the logs if LAMMPS fails", type=Path)
    parser.add_lammps()
    parser.add_output("--table", "table of the dryings, CSV")


def main(args: Namespace) -> None:
    """Dry until the density is met, and write the table."""
    inputs = json.loads(args.inputs.read_text(encoding="utf-8"))
    launcher = Launcher(args.executable, args.launcher, args.ranks)

    with read_frames(args.structure) as store, work_folder(args.work) as folder:

        def density(friction: float) -> float:
            force_field = args.settings["force_field"] | {"friction": friction}
            settings = args.settings | {"force_field": force_field}
            tape = dry(store, inputs, settings, launcher, folder.path, lambda line: None)
            print(f"friction {friction:.4g}: {tape.rows[-1]['density_g_cm3']:.4f} g/cm3")
            return tape.rows[-1]["density_g_cm3"]

        ends = (args.least, args.most)
        made = list(bisection(density, args.green_density_g_cm3, ends, args.tolerance, args.dryings))
    write_table(args.table, [{"friction": friction, "green_density_g_cm3": found} for friction, found in made])
    friction, found = made[-1]
    print(f"drying.force_field.friction: {friction:.4g} # green density {found:.4g} g/cm3")


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
