"""Find the friction of the drying at which a tape has a measured green density, or what friction decides at most.

In: an equilibrated slurry (HDF5, its last frame), the inputs of its DEM, the settings of the drying, and the density.
Out: a table (CSV) of one row a drying: friction, green_density_g_cm3 and packing_fraction (volume of the particles over
that of the box). The density falls with friction. The first two rows are those of --most and --least. Without a
measured density there are no others. With one, friction is halved between them on a logarithmic scale until the density
is within --tolerance, a share of it, or --dryings have been made, and the last row is nearest to the measured one: that
of an end once more, if none is nearer. A density beyond both ends is met by no friction: then there are only their
rows, and a warning.

The ends are the friction of the shipped slurry, and the one with which the ARTISTIC online calculator dries battery
electrodes (its published scripts, Zenodo 5956353).
"""

import json
import sys
from pathlib import Path

from slurrycast.data.frames import read_frames
from slurrycast.data.tables import write_table
from slurrycast.dem.calibration import bisection
from slurrycast.dem.drying_run import dry
from slurrycast.dem.lammps_run import Launcher
from slurrycast.runtime.command_line import Namespace, Parser, run_main
from slurrycast.runtime.costs import measured_cost
from slurrycast.runtime.work_folder import work_folder


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_input("--structure", "equilibrated slurry, HDF5")
    parser.add_input("--inputs", "JSON of generate_inputs.py")
    parser.add_value("--settings", "JSON, as for dry_slurry, whose friction does not count", type=json.loads)
    parser.add_value("--green-density-g-cm3", "measured green density, if known", type=float, required=False)
    parser.add_value("--least", "least friction", type=float, default=0.015)
    parser.add_value("--most", "greatest friction", type=float, default=12.5)
    parser.add_value("--tolerance", "share of the density that is near enough", type=float, default=0.003)
    parser.add_value("--dryings", "number of dryings at most", type=int, default=9)
    parser.add_value("--work", "work folder; kept with the logs if LAMMPS fails", type=Path)
    parser.add_lammps()
    parser.add_output("--table", "table of the dryings, CSV")
    parser.add_output("--cost", "cost record, JSON")


def main(args: Namespace) -> None:
    """Dry at both ends, and until a measured density is met, and write the table."""
    inputs = json.loads(args.inputs.read_text(encoding="utf-8"))
    launcher = Launcher(args.executable, args.launcher, args.ranks)

    packing = {}
    with read_frames(args.structure) as store, work_folder(args.work) as folder:
        slurry, surrogate = str(store.attributes["slurry"]), str(store.attributes.get("surrogate", "-"))

        def density(friction: float) -> float:
            force_field = args.settings["force_field"] | {"friction": friction}
            settings = args.settings | {"force_field": force_field}
            tape = dry(store, inputs, settings, launcher, folder.path, lambda line: None).rows[-1]
            print(f"friction {friction:.4g}: {tape['density_g_cm3']:.4f} g/cm3")
            packing[friction] = tape["packing_fraction"]
            return tape["density_g_cm3"]

        with measured_cost(args.cost, "calibrate_drying", surrogate, slurry) as cost:
            cost.particles = len(store.particles)
            if args.green_density_g_cm3 is None:
                made = [(friction, density(friction)) for friction in (args.most, args.least)]
            else:
                ends = (args.least, args.most)
                made = list(bisection(density, args.green_density_g_cm3, ends, args.tolerance, args.dryings))
    rows = [
        {"friction": friction, "green_density_g_cm3": found, "packing_fraction": packing[friction]}
        for friction, found in made
    ]
    write_table(args.table, rows)
    if len(made) > 2:
        print(f"drying.force_field.friction: {made[-1][0]:.4g} # green density {made[-1][1]:.4g} g/cm3")
    elif args.green_density_g_cm3 is not None:
        (most, loosest), (least, densest) = made
        print(
            f"warning: a green density of {args.green_density_g_cm3:g} g/cm3 is met by no friction: {loosest:.4g} to "
            f"{densest:.4g} are those of {most:g} and {least:g}",
            file=sys.stderr,
        )


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
