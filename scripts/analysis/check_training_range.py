"""Check which predicted slurries lie outside the range of the training slurries at the last input frame.

In: frame stores (HDF5) of the slurries that are predicted, and what the surrogates learned from: frame stores of the
training slurries of this run, and what models that were trained elsewhere say of theirs (JSON of describe_model.py).
Out: a table (CSV) of one row a predicted slurry and quantity: its value, the least and greatest one of the training
slurries, and whether it is outside (yes, no). `model` says whose training slurries: "this run", or the label of a model
that was trained elsewhere. Quantities are the number of particles, the shortest and longest edge of the box (um) and
its Lz/Lx, the density (g/cm3), the number fraction of each phase, the mean radius (um) over all particles and over
those of each phase, and the density of each phase (g/cm3). A network that learned from earlier frames too has seen the
densities of the slurry there: they belong to the range.

Particles, edges and densities are outside as soon as they leave the range of the training slurries. Lz/Lx, which a run
keeps, is not while it leaves by no more than 1e-9 of itself, its rounding. Fractions and mean radii of one recipe
differ between slurries since particles are whole: they are not while a slurry of other rounding, by half a particle of
each phase and a particle of each of its size classes, would be inside. A model that says nothing has no rows.
"""

from dataclasses import asdict

from slurrycast.analysis.slurry_states import has_frame, read_state
from slurrycast.analysis.training_range import THIS_RUN, Range, compare_with_training, training_range
from slurrycast.data.tables import write_table
from slurrycast.runtime.command_line import Namespace, Parser, named_file, run_main
from slurrycast.runtime.costs import measured_cost
from slurrycast.surrogates.trained_on import read_trained_on

COLUMNS = ("slurry", "role", "model", "quantity", "value", "training_min", "training_max", "outside")


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_input("--training", "DEM frames of slurries to learn from", nargs="*", default=[])
    models = {"type": named_file, "nargs": "*", "default": [], "metavar": "LABEL=PATH"}
    parser.add_input("--models", "trained_on.json of models that were trained elsewhere", **models)
    parser.add_input("--predicted", "DEM frames of the others", nargs="+")
    parser.add_value("--roles", "role of each of --predicted, in order", nargs="+")
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


def known_ranges(args: Namespace) -> dict[str, tuple[int, dict[str, Range]]]:
    """Number of the last input frame, and the range of each quantity there in the slurries that were trained on.

    By this run, and by each model that was trained elsewhere, which may take other frames.
    """
    earlier = range(args.first_frame_seen, args.last_input_frame)
    read = [read_state(path, args.last_input_frame, earlier) for path in args.training]
    ranges = {}
    if read:
        earlier_g_cm3 = [density for each in read for density in each.earlier_g_cm3]
        ranges[THIS_RUN] = (args.last_input_frame, training_range((each.state for each in read), earlier_g_cm3))
    for label, path in args.models:
        if known := read_trained_on(path):
            limits = {name: Range(**limits) for name, limits in known["range"].items()}
            ranges[label] = (max(known["input_frames"]), limits)
        else:
            print(f"{label}: the model does not say what it was trained on: its training range is not known")
    return ranges


def main(args: Namespace) -> None:
    """Compare every slurry and write the table; those outside are said too."""
    with measured_cost(args.cost, "check_training_range"):
        ranges, rows = known_ranges(args), []
        for path, role in zip(args.predicted, args.roles, strict=True):
            for model, (last_frame, training) in ranges.items():
                # a DEM of role new ends with the frames that the main job needs; models of later ones predict none
                if role == "new" and last_frame > args.last_input_frame and not has_frame(path, last_frame):
                    continue
                predicted = read_state(path, last_frame)
                compared = compare_with_training(predicted.state, training)
                outside = [name for name, values in compared.items() if values.outside]
                if outside:
                    whose = "the training range" if model == THIS_RUN else f"the training range of {model}"
                    print(f"[{predicted.slurry}] outside {whose}: {', '.join(outside)}")
                for name, values in compared.items():
                    row = {"slurry": predicted.slurry, "role": role, "model": model, "quantity": name}
                    rows.append({**row, **asdict(values), "outside": "yes" if values.outside else "no"})
        write_table(args.table, rows, COLUMNS)


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
