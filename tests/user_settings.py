"""The environment of a user whose own programs need other settings than ours."""

import json
import os
from pathlib import Path

SETTINGS = {"font.size": 31, "figure.facecolor": "red", "savefig.transparent": True, "backend": "tkagg"}
KERAS = {"floatx": "float64", "epsilon": 1e-3, "backend": "torch", "image_data_format": "channels_first"}
PACKAGES = ("numpy", "pandas", "h5py", "jsonschema", "matplotlib", "keras")


def hostile(folder: Path) -> dict[str, str]:
    """Environment with variables of all kinds, and with files in `folder` that they name."""
    other, home = folder / "other", folder / "home"
    for package in PACKAGES:
        (other / package).mkdir(parents=True)
        (other / package / "__init__.py").write_text(f'raise ImportError("{package} of another Python")\n')
    (other / "python").write_text("#!/bin/sh\necho another Python; exit 3\n")
    (other / "python").chmod(0o755)
    (other / "bashrc").write_text(f"export PATH='{other}':$PATH\n")
    (home / ".keras").mkdir(parents=True)
    (home / ".keras" / "keras.json").write_text(json.dumps(KERAS))
    (home / ".config" / "matplotlib").mkdir(parents=True)
    for matplotlibrc in (folder / "matplotlibrc", home / ".config" / "matplotlib" / "matplotlibrc"):
        matplotlibrc.write_text("".join(f"{name}: {value}\n" for name, value in SETTINGS.items()))
    return os.environ | {
        "HOME": str(home),
        "BASH_ENV": str(other / "bashrc"),
        "BASH_FUNC_python%%": "() {  echo a function; return 4\n}",
        "PYTHONPATH": str(other),
        "PYTHONSAFEPATH": "1",
        "PYTHONIOENCODING": "ascii",
        "LC_ALL": "C",
        "KERAS_HOME": str(home / ".keras"),
        "KERAS_BACKEND": "torch",
        "KERAS_MAX_EPOCHS": "1",
        "TF_USE_LEGACY_KERAS": "1",
        "TF_XLA_FLAGS": "--of_another_version",
        "XLA_FLAGS": "--of_another_version",
        "MPLBACKEND": "module://of_a_notebook",
        "MATPLOTLIBRC": str(home / ".config" / "matplotlib"),
        "PYVISTA_PLOT_THEME": "dark",
        "TMPDIR": str(folder / "missing"),
        "XDG_CACHE_HOME": "/proc/none",
    }
