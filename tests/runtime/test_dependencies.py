"""The modules that a rule depends on, against what Python loads when it runs the script."""

import json
import subprocess
import sys

import pytest

from slurrycast.runtime.dependencies import RUNTIME, modules, templates

LOADED = """
import json, pathlib, runpy, sys
sys.argv = [sys.argv[1], "--help"]
sys.path.insert(0, str(pathlib.Path(sys.argv[0]).parent))
try:
    runpy.run_path(sys.argv[0], run_name="__main__")
except SystemExit:
    pass
files = [getattr(module, "__file__", None) for name, module in sys.modules.items() if name.startswith("slurrycast")]
print("\\n" + json.dumps(files))
"""


@pytest.mark.parametrize("script", ["run_slurry", "compute_rdf", "predict_slurry", "collect_costs"])
def test_modules_are_those_that_python_loads(root, script):
    (path,) = root.glob(f"scripts/*/{script}.py")
    script = path.relative_to(root).as_posix()
    done = subprocess.run([sys.executable, "-c", LOADED, path], capture_output=True, text=True, check=True, cwd=root)
    loaded = {file.removeprefix(f"{root}/") for file in json.loads(done.stdout.splitlines()[-1])}
    empty = {file for file in loaded if file.endswith("__init__.py") and "def " not in (root / file).read_text()}
    assert {file for file in loaded - empty if not file.startswith(RUNTIME)} == set(modules(script)) - empty


@pytest.mark.parametrize(
    ("surrogate", "files"),
    [
        ("vgg16", ["vgg16", "samples", "checkpoint"]),
        ("neighbours", [f"neighbours/{name}" for name in ("__init__", "graph", "targets", "network", "training")]),
    ],
)
def test_surrogate_is_added(surrogate, files):
    script = "scripts/surrogate/predict_slurry.py"
    paths = {f"scripts/slurrycast/surrogates/{file}.py" for file in files}
    assert not paths & set(modules(script))
    assert paths <= set(modules(script, surrogate))


def test_no_dem_depends_on_analysis_or_plumbing():
    other = ["runtime/files", "runtime/costs", "analysis/rdf", "analysis/errors", "report/figures", "surrogates/vgg16"]
    paths = {f"scripts/slurrycast/{module}.py" for module in (*other, "dem/equilibrium")}
    for script in ("generate_inputs", "run_slurry"):
        assert not paths & set(modules(f"scripts/dem/{script}.py"))


@pytest.mark.parametrize(("page", "other"), [("report", "evaluation"), ("evaluation", "report")])
def test_a_page_depends_on_its_templates_and_the_shared_ones(root, page, other):
    paths = templates(page)
    folder = "scripts/slurrycast/report/templates"
    assert {f"{folder}/{name}.html.jinja" for name in ("base", "macros", f"{page}/page")} <= set(paths)
    assert not [path for path in paths if path.startswith(f"{folder}/{other}/")]
    assert all((root / path).is_file() for path in paths)
