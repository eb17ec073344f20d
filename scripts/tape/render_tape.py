"""Picture a slurry and its tapes side by side, all of them lying on the carrier.

In: the slurry (HDF5; its last frame) and its tape from each of --sources (HDF5).
Out: PNG; all structures wrapped into their own box, with its thickness Lz.
"""

from slurrycast.report.names import source_name
from slurrycast.report.rendering import on_one_level, read_structure, render
from slurrycast.runtime.command_line import Namespace, Parser, run_main


def named(stage: str, source: str) -> str:
    """Title of a picture, in two lines, since labels of surrogates may be long."""
    return f"{stage}\n{source_name(source)}"


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_input("--slurry", "equilibrated slurry, HDF5")
    parser.add_value("--slurry-source", "dem or a surrogate")
    parser.add_value("--sources", "dem or a surrogate, in the order of --tapes", nargs="+")
    parser.add_input("--tapes", "dried.h5 of each source", nargs="+")
    parser.add_output("--figure", "PNG")
    parser.one_each("sources", "tapes")


def main(args: Namespace) -> None:
    """Read the structures and render them."""
    structures = [read_structure(args.slurry, named("Slurry", args.slurry_source))]
    for source, path in zip(args.sources, args.tapes, strict=True):
        structures.append(read_structure(path, named("Tape", source)))
    render(on_one_level(structures), args.figure)


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
