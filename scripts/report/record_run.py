"""Record what a run was asked for and with what it was made.

In: the effective configuration, the rows of the slurry table, and the versions that Snakemake saw (commit of the
workflow, Python, packages), all as JSON; the command line of Snakemake.
Out: the configuration as YAML; the slurry table; the versions as JSON, with what LAMMPS and its MPI say of themselves,
the machine and the time of this record, and a copy that stays when another commit or other packages are recorded. Its
name stands with the checksum of every output (`.checksums/` beside it), so each can be traced to the versions that made
it.
"""

import json
import platform
import re
from datetime import UTC, datetime
from pathlib import Path

import psutil
import yaml

from slurrycast.runtime import provenance
from slurrycast.runtime.command_line import Namespace, Parser, run_main
from slurrycast.runtime.files import InputError, write_text
from slurrycast.runtime.lammps_help import LammpsHelp, ask
from slurrycast.runtime.programs import Launcher


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_value("--effective", "configuration as JSON", type=json.loads)
    parser.add_value("--rows", "rows of the slurry table as JSON", type=json.loads)
    parser.add_value("--made-with", "versions as JSON", type=json.loads)
    parser.add_value("--command", "command line of Snakemake")
    parser.add_output("--config", "configuration, YAML")
    parser.add_output("--slurries", "slurry table")
    parser.add_output("--versions", "versions, JSON")
    parser.add_output("--kept", "the same, under the name of these versions")


def processor() -> str:
    """Model and number of processors, and memory."""
    try:
        model = re.search(r"^model name\s*: (.*)", Path("/proc/cpuinfo").read_text(), re.MULTILINE)[1]
    except (OSError, TypeError):
        model = platform.machine()
    return f"{psutil.cpu_count()} x {model}, {psutil.virtual_memory().total / 2**30:.0f} GiB"


def lammps_says(executable: str) -> dict[str, str]:
    """Version of LAMMPS, and of the MPI it is linked to, from its own help text."""
    launcher = Launcher(executable, "", 1)
    try:
        said = ask(launcher)
    except InputError:  # as where only compute nodes have it
        said = LammpsHelp(launcher, "")
    return {"lammps_version": said.version, "mpi": said.mpi}


def main(args: Namespace) -> None:
    """Write the files."""
    write_text(args.config, yaml.safe_dump(args.effective, sort_keys=False, allow_unicode=True))
    lines = [args.rows[0], *(row.values() for row in args.rows)]
    write_text(args.slurries, "".join("\t".join(map(str, cells)) + "\n" for cells in lines))
    packages = provenance.package_versions() | args.made_with["packages"]  # of a Conda environment, if it has one
    versions = {
        "name": provenance.name_of(args.made_with),
        "recorded": datetime.now(UTC).isoformat(timespec="seconds"),
        "command": args.command,
        **args.made_with,
        "platform": platform.platform(),
        "machine": processor(),
        **lammps_says(args.effective["dem"]["executable"]),
        "packages": packages,
    }
    for path in (args.versions, args.kept):
        write_text(path, json.dumps(versions, indent=1, ensure_ascii=False) + "\n")


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
