"""What a user has set for other programs does not reach jobs and scripts."""

import json
import os
import site
import subprocess
import sys
from pathlib import Path

import pytest

from configurations import ROOT
from script_runs import run_script
from slurrycast.runtime.environment import isolate_jobs
from user_settings import hostile

PROCESS = """
import json, os, sys
from pathlib import Path
sys.path.insert(0, {scripts!r})
from slurrycast.runtime import environment
try:
    environment.isolate_jobs(Path({scripts!r}), Path("cache"))
except environment.InputError as error:
    sys.exit(str(error))
print(json.dumps([dict(os.environ), sys.path]))
"""
TRAINING = """
import sys
from slurrycast.runtime.command_line import run_main
def main(args):
    from slurrycast.surrogates.backend import start_keras
    start_keras()
    import os
    from keras import config
    print(config.backend(), config.floatx(), config.image_data_format(), config.epsilon(), config.max_epochs(), end=" ")
    import tensorflow as tf
    print(os.environ["KERAS_HOME"], "µm", tf.config.threading.get_intra_op_parallelism_threads(), end="")
sys.argv = ["train"]
run_main(main, lambda parser: None, None)
"""
SCRIPTS = str(ROOT / "scripts")


def output(code: str, environ: dict[str, str], cwd: Path, python: Path | str = sys.executable) -> str:
    """What Python code prints, with an error code on stderr, in some environment."""
    command = [python, "-c", code.format(scripts=SCRIPTS)]
    done = subprocess.run(command, cwd=cwd, env=environ, capture_output=True, encoding="utf-8")
    return done.stdout if done.returncode == 0 else done.stderr


def test_jobs_get_no_setting_and_no_path_of_the_user(tmp_path):
    user = hostile(tmp_path) | {"PYTHONOPTIMIZE": "2"}
    environ, path = json.loads(output(PROCESS, user, tmp_path))
    unset = ("BASH_ENV", "BASH_FUNC_python%%", "PYTHONSAFEPATH", "PYTHONOPTIMIZE", "PYTHONIOENCODING")
    assert not environ.keys() & {*unset, "KERAS_MAX_EPOCHS", "TF_USE_LEGACY_KERAS", "XLA_FLAGS", "PYVISTA_PLOT_THEME"}
    stated = ("KERAS_HOME", "KERAS_BACKEND", "MPLBACKEND", "MATPLOTLIBRC", "PYTHONPATH")
    assert not [name for name in stated if environ[name] == user[name]]
    assert {name: environ[name] for name in ("HOME", "LC_ALL", "TMPDIR")}.items() <= user.items()
    assert environ["PATH"].split(os.pathsep)[0] == str(Path(sys.executable).parent)
    assert path[0] == environ["PYTHONPATH"] == SCRIPTS
    assert str(tmp_path / "other") not in path


def test_packages_that_are_only_in_pythonpath_are_refused(tmp_path):
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", tmp_path / "bare"], check=True)
    python = tmp_path / "bare" / "bin" / "python"
    (tmp_path / "numpy").mkdir()
    (tmp_path / "numpy" / "__init__.py").touch()
    said = output(PROCESS, os.environ | {"PYTHONPATH": str(tmp_path)}, tmp_path, python)
    assert said == f"{tmp_path}/bare: numpy is not installed there, and jobs see no PYTHONPATH: use a venv\n"


@pytest.mark.parametrize("other", [None, "/bin/sh"])
def test_a_python_that_jobs_would_not_find_is_refused(tmp_path, other):
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", tmp_path / "bare"], check=True)
    python3 = tmp_path / "bare" / "bin" / "python3"
    real = python3.resolve()
    for name in ("python", "python3"):
        python3.with_name(name).unlink(missing_ok=True)
    python3.symlink_to(real)
    if other:
        python3.with_name("python").symlink_to(other)
    said = output(PROCESS, dict(os.environ), tmp_path, python3)
    assert said.startswith(f"{tmp_path}/bare/bin: no `python` beside the Python that runs Snakemake")
    assert said.count("\n") == 1


@pytest.mark.parametrize("content", [b"font.family: Fu\xdfnote\n", None])
def test_settings_that_matplotlib_cannot_decode_are_refused(tmp_path, content):
    path = tmp_path / "matplotlibrc"
    if content is None:
        path.mkdir()  # which matplotlib passes over
    else:
        path.write_bytes(content)
    said = output(PROCESS, dict(os.environ), tmp_path)
    refused = f"{path}: matplotlib reads it from the working directory: must be UTF-8, or lie elsewhere\n"
    assert (said == refused) == (content is not None)


@pytest.mark.parametrize("others", [True, False])
def test_packages_of_pip_user_count_only_if_there_are_no_others(tmp_path, monkeypatch, others):
    user, folder = tmp_path / "user", tmp_path / "site-packages"
    for packages in [user, folder] if others else [user]:
        (packages / "numpy").mkdir(parents=True)
        (packages / "numpy" / "__init__.py").touch()
    monkeypatch.setattr(site, "getusersitepackages", lambda: str(user))
    monkeypatch.setattr(sys, "path", [str(user), str(folder)])
    monkeypatch.setattr(os, "environ", dict(os.environ))
    isolate_jobs(ROOT / "scripts", tmp_path)
    assert (str(user) not in sys.path, "PYTHONNOUSERSITE" in os.environ) == (others, others)


def test_keras_by_hand_has_our_settings(tmp_path):
    user = hostile(tmp_path) | {"PYTHONPATH": SCRIPTS}  # by hand it is what the user wants
    said = output(TRAINING, user, tmp_path).splitlines()[-1]
    assert said == rf"tensorflow float32 channels_last 1e-07 None {os.devnull} \xb5m 1"


@pytest.fixture(scope="module")
def graph(tmp_path_factory) -> Path:
    """A small graph of rules."""
    path = tmp_path_factory.mktemp("graph") / "rules.dot"
    path.write_text('0[label = "run_slurry"]\n1[label = "extract_frames"]\n0 -> 1\n')
    return path


def test_figures_by_hand_do_not_depend_on_settings_of_matplotlib(tmp_path, command, graph):
    user = hostile(tmp_path) | {"PYTHONPATH": SCRIPTS}
    expected, drawn = tmp_path / "expected.png", tmp_path / "drawn.png"
    assert run_script("plot_workflow", rulegraph=graph, figure=expected).returncode == 0
    done = subprocess.run(
        command("plot_workflow", rulegraph=graph, figure=drawn), cwd=tmp_path, env=user, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert drawn.read_bytes() == expected.read_bytes()
