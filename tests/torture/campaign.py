"""Kill the workflow, damage its files, fill its disk, and see whether anything is lost: a table, and exit code 1 if so.

    python tests/torture/campaign.py                      the whole campaign on the tiny configuration, some 20 minutes
    python tests/torture/campaign.py --kills 3 --files 5  a short one

The workflow is copied to a folder of its own and run there once undisturbed, which is the reference. Only processes
that the campaign started are killed. Each moment and each damaged byte follows from the seed; on a machine of another
speed the same moment finds the job elsewhere.
"""

import argparse
import contextlib
import csv
import shutil
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, fields
from pathlib import Path

import corruption
import folders
import kills
from project import Injection, Project

# A job that reads a restart file, which the main job writes for it.
EARLY_DEM = "results/tiny/hybrid/early_dem_x2/1/predicted.h5"


def parse_args() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", default=1, type=int, help="of moments, victims and bytes")
    parser.add_argument("--kills", default=30, type=int, help="how many processes are killed")
    parser.add_argument("--files", type=int, help="how many files are damaged; all kinds in both ways if not given")
    parser.add_argument("--no-folders", action="store_true", help="without full disks and the like")
    parser.add_argument("--no-evaluation", action="store_true", help="without the files of the evaluation")
    parser.add_argument("--minutes", default=20.0, type=float, help="nothing is injected any more after this time")
    parser.add_argument("--target", default="all", help="what Snakemake is asked for")
    parser.add_argument("--overlay", type=Path, help="configuration file that is laid over config/tiny.yaml")
    parser.add_argument("--table", type=Path, help="out: each injection, CSV")
    parser.add_argument("--keep", type=Path, help="folder for copy and results, kept; otherwise a temporary one")
    return parser.parse_args()


def campaign(args: argparse.Namespace, folder: Path) -> Iterator[Injection]:
    """The whole campaign in `folder`; yields what was injected, as it happens."""
    limit_s = time.monotonic() + 60 * args.minutes
    project, reference = Project(folder / "checkout", args.target, args.overlay), folder / "reference"
    typical_s = kills.undisturbed(project, "--notemp")
    shutil.copytree(project.results, reference, ignore=shutil.ignore_patterns("dump.lammpstrj", "work"))
    jobs = project.jobs(project.target)
    if args.no_evaluation:
        readers = project.jobs(project.target, EARLY_DEM)
    else:
        readers = project.jobs(project.target, "evaluation")
        project.run("evaluation", "--notemp")
    yield from corruption.refused(project, readers, args.seed, limit_s, args.files)
    if args.files is None:
        yield from corruption.redone(project, reference, jobs, args.seed, limit_s)
    yield from kills.Torture(project, reference, jobs, typical_s, args.seed).run(args.kills, limit_s)
    if not args.no_folders:
        yield from folders.vanishing(project, reference, jobs, args.seed, limit_s)
        yield from folders.full_and_read_only(project, reference, jobs, args.seed, limit_s)
        yield from folders.growing(project, reference, args.seed, limit_s)


def summary(injections: Sequence[Injection]) -> str:
    """How many were injected, survived and lost, by kind and stage, and what was lost."""
    kinds = list(dict.fromkeys(injection.kind for injection in injections))
    lines = [f"{'':24}{'injected':>10}{'survived':>10}{'lost':>10}"]
    for kind in [*kinds, "all"]:
        of_kind = [injection for injection in injections if kind in (injection.kind, "all")]
        lost = sum(bool(injection.lost) for injection in of_kind)
        lines.append(f"{kind:24}{len(of_kind):10}{len(of_kind) - lost:10}{lost:10}")
    lines += [f"lost: {i.kind}, {i.stage}, {i.target}, {i.how}: {i.lost}" for i in injections if i.lost]
    return "\n".join(lines)


def write_table(path: Path, injections: Sequence[Injection]) -> None:
    """One row for each injection."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", newline="", encoding="utf-8") as file:
        table = csv.DictWriter(file, ["number", *(field.name for field in fields(Injection))], lineterminator="\n")
        table.writeheader()
        table.writerows({"number": n, **asdict(injection)} for n, injection in enumerate(injections, start=1))


def main() -> None:
    """Run, print, write."""
    args = parse_args()
    sys.stdout.reconfigure(line_buffering=True)
    injections, start_s = [], time.monotonic()
    with contextlib.ExitStack() as stack:
        if args.keep:
            args.keep.mkdir(parents=True)
        folder = args.keep or Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="slurrycast torture ")))
        for injection in campaign(args, folder.absolute()):
            injections.append(injection)
            said = f"LOST: {injection.lost}" if injection.lost else "survived"
            words = (injection.kind, injection.stage, injection.target, injection.how, injection.outcome, said)
            print(f"[{(time.monotonic() - start_s) / 60:.1f} min] {': '.join(filter(None, words))}")
    print(summary(injections))
    if args.table:
        write_table(args.table, injections)
    sys.exit(any(injection.lost for injection in injections))


if __name__ == "__main__":
    main()
