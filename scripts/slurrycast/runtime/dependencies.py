"""Which files of the package a script uses, so that an edit reruns what depends on it and nothing else."""

import ast
import functools
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
TEMPLATES = "scripts/slurrycast/report/templates"
SURROGATES = "scripts/slurrycast/surrogates"
# How scripts start, stop, move files into place, go on and count seconds: no reason to repeat a run of days.
RUNTIME = "scripts/slurrycast/runtime/"


@functools.cache
def _imports(path: str) -> frozenset[str]:
    """Modules of the package that a file itself imports."""
    names = set()
    for node in ast.walk(ast.parse((ROOT / path).read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and (node.module or "").partition(".")[0] == "slurrycast":
            names |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
    stems = [f"scripts/{name.replace('.', '/')}" for name in names]
    files = (file for stem in stems for file in (f"{stem}.py", f"{stem}/__init__.py"))
    return frozenset(file for file in files if (ROOT / file).is_file())


def modules(script: str, surrogate: str | None = None) -> list[str]:
    """Files of the package that `script` imports, itself or through others, and those of the `surrogate` that it loads.

    Without those of RUNTIME. Paths are relative to the project folder, sorted.
    """
    named = () if surrogate is None else (f"{SURROGATES}/{surrogate}.py", f"{SURROGATES}/{surrogate}/__init__.py")
    files, left = set(), {*_imports(script), *(file for file in named if (ROOT / file).is_file())}
    while left:  # a package and its modules may import each other
        files |= left
        left = set().union(*map(_imports, left)) - files
    return sorted(file for file in files if not file.startswith(RUNTIME))


def templates(page: str) -> list[str]:
    """Templates of a page, such as "report", and those that all pages share; paths as those of `modules`."""
    folders = (ROOT / TEMPLATES, ROOT / TEMPLATES / page)
    return sorted(str(path.relative_to(ROOT)) for folder in folders for path in folder.glob("*.jinja"))
