"""Ask Snakemake for the graph of its rules.

In: the Snakefile, the effective configuration (YAML).
Out: the graph in DOT, as `snakemake --rulegraph` prints it.
"""

import subprocess
import sys

from slurrycast.runtime.command_line import Namespace, Parser, run_main
from slurrycast.runtime.files import RunError, write_text
from slurrycast.runtime.programs import ending


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_input("--snakefile", "Snakefile of the workflow")
    parser.add_input("--config", "effective configuration, YAML")
    parser.add_output("--rulegraph", "graph of the rules, DOT")


def main(args: Namespace) -> None:
    """Ask and write."""
    command = [sys.executable, "-m", "snakemake", "--snakefile", args.snakefile, "--rulegraph"]
    command += ["--configfile", args.config]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        raise RunError(f"snakemake --rulegraph: {ending(done.returncode, (done.stdout + done.stderr).splitlines())}")
    write_text(args.rulegraph, done.stdout)


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
