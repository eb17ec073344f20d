"""Two clones that share one environment: an editable install holds the path of one, jobs import the package of each."""

import subprocess
import sys
import sysconfig
import venv
from pathlib import Path

from checkouts import copy_checkout, snakemake

TARGET = "results/tiny/dem/T1/inputs.json"


def environment_with_editable_install(folder: Path, project: Path) -> Path:
    """Make an environment with the packages of this one, in which the package of `project` is installed; its Python.

    The .pth file is what `pip install --editable` writes for this package.
    """
    venv.create(folder, symlinks=True)
    site_packages = Path(sysconfig.get_path("purelib", vars={"base": str(folder), "platbase": str(folder)}))
    others = [path for path in sys.path if path.endswith("site-packages")]
    (site_packages / "__editable__.slurrycast.pth").write_text("\n".join([str(project / "scripts"), *others]) + "\n")
    return folder / "bin" / "python"


def test_jobs_import_the_package_beside_the_snakefile(tmp_path, monkeypatch):
    monkeypatch.delenv("PYTHONPATH")
    first, second = copy_checkout(tmp_path / "first"), copy_checkout(tmp_path / "second")
    with (first / "scripts/slurrycast/__init__.py").open("a") as package:
        package.write('\nraise ImportError("this is the package of the first clone")\n')
    python = environment_with_editable_install(tmp_path / "environment", first)

    script = [python, second / "scripts/dem/generate_inputs.py", "--help"]
    by_hand = subprocess.run(script, cwd=tmp_path, capture_output=True, text=True)
    assert "this is the package of the first clone" in by_hand.stderr

    snakemake(second, TARGET, "--configfile", "config/tiny.yaml", python=python)
    assert (second / TARGET).is_file()
