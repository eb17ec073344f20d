"""Put the structural error of every surrogate after relaxation beside its cost, slurry by slurry.

In: cost records of all jobs of the hybrid chain, tables/equilibrium.csv, the run.json of every slurry compared, the DEM
step of each surrogate's last input frame, and tables/structure_errors.csv.
Out: a table (CSV): surrogate, input_last_frame, slurry, cost_share_of_full_dem (CPU seconds of the hybrid chain end to
end over those of the full DEM, the making of the inputs counted on both sides), density_error (|density / density of
the DEM - 1|), rdf_error (mean |g - g_dem|, all pairs of particles), both after relaxation.
"""

from slurrycast.data.tables import read_equilibrium, read_table, write_table
from slurrycast.dem.lammps_run import steps_per_frame
from slurrycast.evaluation.front import front
from slurrycast.evaluation.speedup import add_dem_runs, compare_costs, read_by_slurry, read_costs
from slurrycast.runtime.command_line import Namespace, Parser, run_main


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_input(
        "--costs",
        "cost records (JSON) of generate_inputs, extract_frames, predict_slurry, wrap_slurry, relax_slurry",
        nargs="+",
    )
    add_dem_runs(parser)
    parser.add_tables("structure_errors")
    parser.add_output("--table", "table of all surrogates and slurries (CSV)")


def main(args: Namespace) -> None:
    """Read, compare, write."""
    costs, runs = read_costs(args.costs), read_by_slurry(args.run_json)
    input_steps = dict(args.input_steps)
    frame_steps = steps_per_frame(next(iter(runs.values()))["physics"]["dem"])  # one section dem for all slurries
    last_frames = {label: steps // frame_steps for label, steps in input_steps.items()}
    speedup = compare_costs(costs, read_equilibrium(args.equilibrium), runs, input_steps, "cpu_s")
    table = front(speedup, read_table(args.structure_errors), last_frames)
    write_table(args.table, table, digits=6)


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
