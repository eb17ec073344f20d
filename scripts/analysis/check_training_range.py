"""Check which predicted slurries lie outside the range of the training slurries at the last input frame.

In: frame stores (HDF5) of the training slurries and of those that are predicted.
Out: a table (CSV) of one row a predicted slurry and quantity: its value, the least and greatest one of the training
slurries, and whether it is outside (yes, no). Quantities are the number of particles, the shortest and longest edge of
the box (um) and its Lz/Lx, the density (g/cm3), the number fraction of each phase and the mean radius over the
particles (um). A network that learned from earlier frames too has seen the densities there: they belong to the range.

Particles, edges and density are outside as soon as they leave the range of the training slurries. Lz/Lx, which a run
keeps, is not while it leaves by no more than 1e-9 of itself, its rounding. Fractions and the mean radius of one recipe
differ between slurries since particles are whole: they are not while a slurry of other rounding, by half a particle of
each phase and a particle of each of its size classes, would be inside.
"""

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from slurrycast.analysis.training_range import State, compare_with_training
from slurrycast.data.frames import read_frames
from slurrycast.data.tables import write_table
from slurrycast.runtime.command_line import Namespace, Parser, run_main
from slurrycast.runtime.costs import measured_cost


def read_state(
    path: Path, frame: int, phases: Sequence[str], earlier: Sequence[int] = ()
) -> tuple[str, State, list[float]]:
    """Read id and state of a slurry at `frame`, with phases in this order, and its densities (g/cm3) at `earlier`."""
    with read_frames(path) as store:
        state = State(store.particles_of(phases), store.box(frame)[1], store.density_g_cm3(frame))
        return str(store.attributes["slurry"]), state, [store.density_g_cm3(number) for number in earlier]


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_input("--training", "DEM frames of slurries to learn from", nargs="+")
    parser.add_input("--predicted", "DEM frames of the others", nargs="+")
    parser.add_value("--roles", "role of each of --predicted, in order", nargs="+")
    parser.add_value("--phases", "names of the phases of all slurries", nargs="+")
    parser.add_value("--last-input-frame", "number of the frame that is looked at", type=int)
    meaning = "number of the frame from which on the density was seen (default: the last)"
    parser.add_value("--first-frame-seen", meaning, type=int, default=None)
    parser.add_output("--table", "table of slurries and quantities (CSV)")
    parser.add_output("--cost", "cost record (JSON)")
    parser.one_each("predicted", "roles")
    parser.add_check(wrong_frame_seen)


def wrong_frame_seen(args: Namespace) -> str | None:
    """Set the default of the first frame seen; what is wrong with it, if anything is."""
    first, last = args.first_frame_seen, args.last_input_frame
    if first is None:
        args.first_frame_seen = first = last
    return None if 0 <= first <= last else f"--first-frame-seen {first}: must be from 0 to --last-input-frame {last}"


def main(args: Namespace) -> None:
    """Compare every slurry and write the table; those outside are said too."""
    with measured_cost(args.cost, "check_training_range"):
        earlier = range(args.first_frame_seen, args.last_input_frame)
        read = [read_state(path, args.last_input_frame, args.phases, earlier) for path in args.training]
        training = [training_slurry for _, training_slurry, _ in read]
        earlier_g_cm3 = [density for *_, densities_g_cm3 in read for density in densities_g_cm3]
        rows = []
        for path, role in zip(args.predicted, args.roles, strict=True):
            slurry, predicted, _ = read_state(path, args.last_input_frame, args.phases)
            compared = compare_with_training(predicted, training, earlier_g_cm3)
            outside = [name for name, values in compared.items() if values.outside]
            if outside:
                print(f"[{slurry}] outside the training range: {', '.join(outside)}")
            for name, values in compared.items():
                flag = {"outside": "yes" if values.outside else "no"}
                rows.append({"slurry": slurry, "role": role, "quantity": name, **asdict(values), **flag})
        write_table(args.table, rows)


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
