"""The files from which Snakemake takes settings, checked before the Snakefile reads the first of them.

REQUIRED INPUTS:
    config/config.yaml, files behind --configfile, profiles

OUTPUTS: none, but one error with a line for each problem of a file.
"""

import argparse
import os
import sys
from pathlib import Path

from snakemake.cli import get_profile_dir

sys.path.insert(0, str(Path(workflow.basedir) / "scripts"))
from slurrycast.config.yaml_files import file_problems


def profiles():
    """Files of the profiles of this call; Snakemake keeps their paths to itself."""
    parser = argparse.ArgumentParser(add_help=False, allow_abbrev=False)
    parser.add_argument("--profile", action="append", default=os.environ.get("SNAKEMAKE_PROFILE", "").split(","))
    parser.add_argument("--workflow-profile", default="default")
    called, _ = parser.parse_known_args(sys.argv[1:])
    of_workflow = [
        place / called.workflow_profile for place in (Path(), Path("profiles"), Path(workflow.basedir, "profiles"))
    ]
    found = [get_profile_dir(str(profile)) for profile in [*filter(None, called.profile), *of_workflow]]
    return [file for _, file in filter(None, found)]


if workflow.is_main_process:  # jobs get what was checked here
    DEFAULTS = Path(workflow.basedir, "config", "config.yaml")
    FILES = dict.fromkeys(Path(file).absolute() for file in [*workflow.configfiles, DEFAULTS, *profiles()])
    PROBLEMS = [line for file in FILES for line in file_problems(file)]
    if PROBLEMS:
        raise WorkflowError(*PROBLEMS, "Nothing was run.")
