"""A Slurm of one node on loopback, for the time of a block, in a folder of its own.

Nothing of another Slurm on the machine is used or touched: configuration, key, sockets, ports and state are its own.
`python tests/slurm/cluster.py` says what is missing here to start one, and nothing if nothing is.
"""

import contextlib
import os
import secrets
import shutil
import signal
import socket
import subprocess
import time
from collections.abc import Iterator, Mapping
from pathlib import Path

PROGRAMS = ("munged", "slurmctld", "slurmd", "sbatch", "srun", "squeue", "scancel", "scontrol", "sinfo", "setpriv")
SYSTEM_PATH = "/usr/local/sbin:/usr/sbin:/sbin:/usr/local/bin:/usr/bin:/bin"
START_WAIT_S = 60.0
CPUS = 4  # more than a small machine has: what is tested is the queue, not its speed
CONFIGURATION = f"""\
ClusterName=test
SlurmctldHost=%(host)s(127.0.0.1)
SlurmctldPort=%(controller_port)d
SlurmdPort=%(node_port)d
NodeName=%(host)s NodeAddr=127.0.0.1 CPUs={CPUS} RealMemory=100000 State=UNKNOWN
PartitionName=all Nodes=ALL Default=YES MaxTime=60 State=UP
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket=%(folder)s/munge.socket
StateSaveLocation=%(folder)s/state
SlurmdSpoolDir=%(folder)s/spool
SlurmctldPidFile=%(folder)s/slurmctld.pid
SlurmdPidFile=%(folder)s/slurmd.pid
SlurmctldLogFile=%(folder)s/slurmctld.log
SlurmdLogFile=%(folder)s/slurmd.log
# No cgroups, no database: this has to run in a container. What a job started is found by its process group.
ProctrackType=proctrack/pgid
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU_Memory
SlurmdParameters=config_overrides
ReturnToService=2
# At its walltime a job gets SIGTERM, and SIGKILL half a minute later; both are what Slurm does unless told otherwise.
KillWait=30
OverTimeLimit=0
MinJobAge=600
MessageTimeout=60
SchedulerParameters=batch_sched_delay=0,sched_min_interval=0,sched_interval=2,bf_interval=2
"""


def missing() -> str:
    """Why no Slurm can be started here, in one line; empty if one can."""
    if os.geteuid() != 0:
        return "only root can start a Slurm"
    if lacking := [name for name in PROGRAMS if shutil.which(name, path=SYSTEM_PATH) is None]:
        return f"{', '.join(lacking)} not found: apt-get install slurm-wlm munge"
    return ""


def free_ports(number: int) -> list[int]:
    """Ports of loopback on which nothing listens."""
    with contextlib.ExitStack() as stack:
        sockets = [stack.enter_context(socket.socket()) for _ in range(number)]
        for one in sockets:
            one.bind(("127.0.0.1", 0))
        return [one.getsockname()[1] for one in sockets]


@contextlib.contextmanager
def running_slurm(folder: Path) -> Iterator[dict[str, str]]:
    """Start a Slurm in `folder`, which must not exist; yield the environment in which its commands work.

    RuntimeError with the end of the logs if it does not come up. At the end of the block its daemons and jobs are gone.
    """
    for part in ("state", "spool", "bin"):
        (folder / part).mkdir(parents=True)
    key = folder / "munge.key"
    key.touch(mode=0o400)
    key.write_bytes(secrets.token_bytes(128))
    controller_port, node_port = free_ports(2)
    names = {"host": socket.gethostname().split(".")[0], "folder": folder}
    configuration = folder / "slurm.conf"
    configuration.write_text(
        CONFIGURATION % {**names, "controller_port": controller_port, "node_port": node_port}, encoding="utf-8"
    )
    environment = {
        name: value for name, value in os.environ.items() if not name.startswith(("SLURM_", "SBATCH_", "SRUN_"))
    }
    environment["SLURM_CONF"] = str(configuration)
    # The executor plugin of Snakemake takes SLURM_CONF out of the environment in which its job steps call srun.
    srun = folder / "bin" / "srun"
    srun.write_text(f"#!/bin/sh\nSLURM_CONF='{configuration}' exec {shutil.which('srun', path=SYSTEM_PATH)} \"$@\"\n")
    srun.chmod(0o755)
    environment["PATH"] = f"{srun.parent}:{environment.get('PATH', '')}:{SYSTEM_PATH}"
    munge = {name: folder / f"munge.{name}" for name in ("socket", "pid", "log", "seed")}
    daemons = [
        ["munged", "--foreground", "--force", f"--socket={munge['socket']}", f"--key-file={key}"]
        + [f"--{name}-file={munge[name]}" for name in ("pid", "log", "seed")],
        ["slurmctld", "-D", "-c", "-f", configuration],
        ["slurmd", "-D", "-c", "-f", configuration],
    ]
    started: list[subprocess.Popen] = []
    try:
        for command in daemons:
            with (folder / f"{command[0]}.out").open("wb") as output:
                # ended with the process that runs the block, however that ends
                words = ["setpriv", "--pdeathsig", "KILL", *command]
                started.append(
                    subprocess.Popen(words, env=environment, stdin=subprocess.DEVNULL, stdout=output, stderr=output)
                )
            if command[0] == "munged":
                _wait(folder, started, munge["socket"].exists)
        _wait(folder, started, lambda: _said(environment, "sinfo", "-h", "-o", "%t") in ("idle", "mix", "alloc"))
        yield environment
    finally:
        # Not asked to end: nothing of this Slurm is kept, and its jobs may not listen.
        while left := processes_of(folder):
            for process in left:
                with contextlib.suppress(ProcessLookupError):
                    os.kill(process, signal.SIGKILL)
        for daemon in started:
            daemon.wait()


def processes_of(folder: Path) -> list[int]:
    """Daemons and jobs of the Slurm in `folder`: the processes whose environment names a file in it."""
    mark, found = f"{folder}/".encode(), []
    for entry in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            if mark in (entry / "environ").read_bytes():
                found.append(int(entry.name))
    return found


def _said(environment: Mapping[str, str], *command: str) -> str:
    """What a command of Slurm prints; nothing if it fails."""
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=60, check=False)
    return done.stdout.strip() if done.returncode == 0 else ""


def _until(condition, seconds: float) -> None:
    """Return as soon as `condition()` holds; TimeoutError after `seconds`."""
    end = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > end:
            raise TimeoutError
        time.sleep(0.2)


def _wait(folder: Path, started: list[subprocess.Popen], condition) -> None:
    """Wait until a daemon has come up; RuntimeError with what the daemons said if it does not."""
    with contextlib.suppress(TimeoutError):
        _until(lambda: condition() or any(process.poll() is not None for process in started), START_WAIT_S)
    if not condition():
        logs = [*sorted(folder.glob("*.out")), *sorted(folder.glob("*.log"))]
        ends = "\n".join(f"{log.name}: {log.read_text(errors='replace')[-1500:]}" for log in logs)
        raise RuntimeError(f"Slurm does not come up:\n{ends}")


if __name__ == "__main__":
    print(missing())
