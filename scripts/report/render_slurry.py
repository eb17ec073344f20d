"""Picture the microstructures of one slurry side by side: target, predicted and relaxed (the reference article's Fig.
4).

In: predicted.h5 and relaxed.h5 of the hybrid chain and, if the DEM was run to the end, its frames (H5MD, um).
Out: PNG; all structures wrapped into their own box, with its thickness Lz.
"""

from slurrycast.report.rendering import read_structure, render
from slurrycast.runtime.command_line import Namespace, Parser, run_main


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_input("--predicted", "predicted.h5 (one frame)")
    parser.add_input("--relaxed", "relaxed.h5 (one frame)")
    parser.add_target()
    parser.add_output("--figure", "PNG")


def main(args: Namespace) -> None:
    """Read the structures, render them and put the pictures together."""
    structures = [
        read_structure(args.predicted, "Predicted, wrapped"),
        read_structure(args.relaxed, "Relaxed"),
    ]
    if args.frames is not None:
        structures.insert(0, read_structure(args.frames, "Target (DEM)", args.target_frame))
    render(structures, args.figure)


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
