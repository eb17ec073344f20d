"""Checks before the first job, when it is known what is to be run: of earlier results, and of LAMMPS.

Snakemake deletes the outputs of a job when it starts it. Among its reasons are some that need not concern the results:
files with newer times, or records of earlier jobs that are missing since `.snakemake` was not copied.

REQUIRED INPUTS:
    config[run][overwrite], config[dem]
    all files in the results folder of the run

OUTPUTS: none
"""

from snakemake.settings.types import DeploymentMethod

from slurrycast.config import earlier_results
from slurrycast.runtime import lammps_help
from slurrycast.runtime.files import InputError
from slurrycast.runtime.programs import Launcher


def drop_default_rate_limit():
    """Let Snakemake wait for the next job that ends; a limit of jobs per time span that a user has set stays.

    With any limit it begins to poll anew for each job that ends, and never stops: after 100 jobs it looks 100 times a second
    at the inputs of all jobs that are ready. Its default, 100 jobs a second, limits nothing here.
    """
    limit = workflow.scheduling_settings.max_jobs_per_timespan
    if limit and (limit.max_jobs, limit.timespan) == (100, 1):
        workflow.scheduler.job_rate_limiter = None


def is_finished_dem(job):
    """Whether a job would run a DEM that got as far as it is asked to; not if it only has to collect its outputs."""
    return (
        job.rule.name == "run_slurry"
        and not os.path.exists(job.params.work)
        and earlier_results.reaches(job.output.run, job.params.last_frame)
    )


def loses_results(job):
    """Whether a planned job would delete a finished DEM, or results of which Snakemake does not know how they were made."""
    reason = workflow.dag.reason(job)
    if reason.forced or reason.incomplete_output or not job.output:
        return False
    is_there = all(os.path.exists(path) for path in job.output if not path.is_temp)
    return is_finished_dem(job) or (is_there and not workflow.persistence.has_metadata(job))


def check_earlier_results():
    """Refuse a run that would delete finished results, and a `--touch` of results that cannot be taken over."""
    if workflow.touch:
        lines = list(earlier_results.problems(WRITTEN, SLURRY_TABLE, RESULTS))
        if not workflow.storage_settings.notemp:
            lines += [
                f"{dump}: would be deleted, and has no frames yet: add --notemp"
                for dump in Path(RESULTS).glob("dem/*/dump.lammpstrj")
                if not Path(RESULTS, "frames", f"{dump.parent.name}.h5").exists()
            ]
        if lines:
            raise WorkflowError(*lines, "Nothing was touched.")
    elif not config["run"]["overwrite"]:
        lost = [job for job in workflow.dag.needrun_jobs() if loses_results(job)]
        if lost:
            lost.sort(key=lambda job: (not is_finished_dem(job), job.rule.name, *job.wildcards))
            first, *others = lost
            more = f" and {len(others)} more jobs" if others else ""
            again = "set run.overwrite: true"
            if not is_finished_dem(first):
                again = f"add --forcerun {' '.join(dict.fromkeys(job.rule.name for job in lost))}"
            raise WorkflowError(
                f"{RESULTS}: {' '.join([first.rule.name, *first.wildcards])}{more} would delete finished results and make "
                f"them again (snakemake --dry-run gives the reasons): to take them over as they are, add --touch "
                f"--forceall; to make them again, {again}",
                "Nothing was run.",
            )


def check_restart_files():
    """Refuse to continue a finished DEM that kept no restart file where a surrogate starts, as of one added later."""
    planned = list(workflow.dag.needrun_jobs())
    to_run = [job.wildcards.slurry for job in planned if job.rule.name == "run_slurry"]
    lost = {
        restart_file(job.wildcards): job.wildcards
        for job in planned
        if job.rule.name == "predict_slurry" and goes_on(job.wildcards) and job.wildcards.slurry not in to_run
    }
    lost = {path: wildcards for path, wildcards in lost.items() if not os.path.exists(path)}
    if lost and not workflow.touch:
        path, wildcards = min(lost.items())
        more = f" (and {len(lost) - 1} more)" if len(lost) > 1 else ""
        runs = sorted({f"{RESULTS}/dem/{each.slurry}/run.json" for each in lost.values()})
        raise WorkflowError(
            f"{path}: no such file, {wildcards.surrogate} starts from it{more}: leave the surrogate out, or add --forcerun "
            f"{' '.join(runs)} to run the DEM again",
            "Nothing was run.",
        )


def check_design():
    """Refuse to go on with recipes of a design that would be written anew: they were read before."""
    planned = {job.rule.name for job in workflow.dag.needrun_jobs()}
    if {"write_design", "tabulate_points"} <= planned and not workflow.touch:
        raise WorkflowError(
            f"{RECIPE_TABLE}: is not what section explore of the configuration gives now: run "
            "snakemake --cores 1 design first, or save it under another path and name that in explore.recipes",
            "Nothing was run.",
        )


def check_lammps():
    """Refuse a LAMMPS too old for the planned jobs or without a style; one that only other nodes have is left to them."""
    if workflow.touch:
        return
    deploys = DeploymentMethod.CONDA in workflow.deployment_settings.deployment_method
    planned = [job.resources for job in workflow.dag.needrun_jobs() if job.resources.get("executable")]
    for executable, mpi, tasks in sorted({(job.executable, job.mpi, job.tasks) for job in planned}):
        if deploys and not os.path.isabs(executable):
            continue  # jobs find it in an environment of their own
        try:
            problem = lammps_help.ask(Launcher(executable, mpi, 1 if workflow.non_local_exec else tasks)).problem()
        except InputError as error:
            problem = None if workflow.non_local_exec else str(error)
        if problem:
            raise WorkflowError(problem, "Nothing was run.")
