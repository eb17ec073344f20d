"""Dry an equilibrated slurry in LAMMPS: the solvent leaves in stages, and the tape shrinks in thickness alone.

The particles of one phase lose their solvent; the force field is that of the slurry but for friction, and where asked
for attraction and stiffness. Pressure and thermostat are those of the relaxation, the barostat acts on z only.

In: the slurry, a frame store whose last frame is dried (HDF5, of the DEM or relaxed), and the inputs of its DEM.
Out: the tape as LAMMPS data file and as a frame store of one frame (HDF5). Its attributes hold the thickness of the box
before and after, slurry_thickness_um and tape_thickness_um, and the state at the end as in a relaxed structure; the
pressure is that along z.
And a table (CSV) of the drying: a row for the slurry, for the end of each stage, and for the end of the rest, with
step, solvent_left (share), thickness_um of the box, density_g_cm3, packing_fraction (volume of the particles over that
of the box), pressure_kpa along z and kinetic_share.
"""

import json
import shutil
from pathlib import Path

from slurrycast.data.frames import read_frames, write_frames
from slurrycast.data.tables import write_table
from slurrycast.dem.drying_run import dry
from slurrycast.dem.lammps_run import Launcher
from slurrycast.dem.relaxation import end_state
from slurrycast.runtime.command_line import Namespace, Parser, run_main
from slurrycast.runtime.costs import measured_cost
from slurrycast.runtime.files import moved_into_place
from slurrycast.runtime.work_folder import work_folder


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_input("--structure", "equilibrated slurry, HDF5")
    parser.add_input("--inputs", "JSON of generate_inputs.py")
    parser.add_value(
        "--settings",
        "JSON: section drying of the configuration, with pressure_damping_steps and start_thermal_share of section "
        "relaxation",
        type=json.loads,
    )
    parser.add_value("--work", "work folder; kept with the logs if LAMMPS fails", type=Path)
    parser.add_lammps()
    parser.add_output("--dried-data", "LAMMPS data file")
    parser.add_output("--dried", "tape, HDF5")
    parser.add_output("--table", "table of the drying, CSV")
    parser.add_output("--cost", "cost record, JSON")


def main(args: Namespace) -> None:
    """Dry and write."""
    inputs = json.loads(args.inputs.read_text(encoding="utf-8"))
    launcher = Launcher(args.executable, args.launcher, args.ranks)
    with read_frames(args.structure) as store, work_folder(args.work) as folder:
        slurry, surrogate = str(store.attributes["slurry"]), str(store.attributes.get("surrogate", "-"))
        with measured_cost(args.cost, "dry_slurry", surrogate, slurry) as cost:
            tape = dry(store, inputs, args.settings, launcher, folder.path, print)
            before, after = tape.rows[0], tape.rows[-1]
            attributes = {
                **store.attributes,
                "stage": "dried",
                "seeds": json.dumps(inputs["seeds"] | {"drying": tape.seed}),
                "drying": json.dumps(args.settings),
                "lammps_version": tape.log.version,
                "slurry_thickness_um": before["thickness_um"],
                "tape_thickness_um": after["thickness_um"],
                **end_state(tape.log, "Pzz"),
            }
            attributes.pop("densification", None)  # that of a relaxation
            write_frames(args.dried, tape.particles, [tape.frame], attributes)
            write_table(args.table, tape.rows)
            with moved_into_place(args.dried_data) as part:
                shutil.copyfile(folder.path / "dried.data", part)
            cost.particles, cost.steps = len(tape.particles), tape.steps
    print(
        f"[{slurry}] {surrogate}: dried to {after['density_g_cm3']:.4f} g/cm3 and "
        f"{after['thickness_um'] / before['thickness_um']:.1%} of its thickness"
    )


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
