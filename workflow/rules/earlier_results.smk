"""Before the first job: results that are there already are not deleted by accident, and not taken over damaged.

Snakemake deletes the outputs of a job when it starts it. Among its reasons are some that need not concern the results:
files with newer times, or records of earlier jobs that are missing since `.snakemake` was not copied.

REQUIRED INPUTS:
    config[run][overwrite]
    all files in the results folder of the run

OUTPUTS: none
"""

from slurrycast.config import earlier_results


def loses_results(job):
    """Whether a planned job would delete a finished DEM, or results of which Snakemake does not know how they were made."""
    reason = workflow.dag.reason(job)
    if reason.forced or reason.incomplete_output or not job.output:
        return False
    outputs = [path for path in job.output if not path.is_temp]
    if job.rule.name == "run_slurry":
        outputs.append(f"{RESULTS}/frames/{job.wildcards.slurry}.h5")
    if not all(map(os.path.exists, outputs)):
        return False
    if job.rule.name == "run_slurry" and earlier_results.ends_at(job.output.run, job.params.last_frame):
        return True
    return not workflow.persistence.has_metadata(job)


def check_earlier_results():
    """Refuse a run that would delete finished results, and a `--touch` of results that cannot be taken over."""
    if workflow.touch:
        if lines := list(earlier_results.problems(config, RESULTS)):
            raise WorkflowError(*lines, "Nothing was touched.")
    elif not config["run"]["overwrite"]:
        jobs = filter(loses_results, workflow.dag.needrun_jobs())
        if lost := sorted([job.rule.name, *job.wildcards] for job in jobs):
            first = next((words for words in lost if words[0] == "run_slurry"), lost[0])
            more = f" and {len(lost) - 1} more jobs" if lost[1:] else ""
            raise WorkflowError(
                f"{RESULTS}: {' '.join(first)}{more} would delete finished results and make them again (snakemake --dry-run gives "
                "the reasons): to take them over as they are, add --touch --forceall; to make them again, set "
                "run.overwrite: true",
                "Nothing was run.",
            )
