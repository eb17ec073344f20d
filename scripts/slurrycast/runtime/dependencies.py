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
    """Modules of the package that a file imports, itself or through others."""
    names = set()
    for node in ast.walk(ast.parse((ROOT / path).read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and (node.module or "").partition(".")[0] == "slurrycast":
            names |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
    stems = [f"scripts/{name.replace('.', '/')}" for name in names]
    direct = {file for stem in stems for file in (f"{stem}.py", f"{stem}/__init__.py") if (ROOT / file).is_file()}
    return frozenset(direct.union(*map(_imports, direct)))


def modules(script: str, surrogate: str | None = None) -> list[str]:
    """Files of the package that `script` imports, and those of the `surrogate` that it loads by name.

    Without those of RUNTIME. Paths are relative to the project folder, sorted.
    """
    files = _imports(script)
    for file in (f"{SURROGATES}/{surrogate}.py", f"{SURROGATES}/{surrogate}/__init__.py"):  # a module or a package
        if surrogate is not None and (ROOT / file).is_file():
            files |= {file} | _imports(file)
    return sorted(file for file in files if not file.startswith(RUNTIME))


def templates(page: str) -> list[str]:
    """Templates of a page, "report" or "evaluation", and those that all pages share; paths as those of `modules`."""
    folders = (ROOT / TEMPLATES, ROOT / TEMPLATES / page)
    return sorted(str(path.relative_to(ROOT)) for folder in folders for path in folder.glob("*.jinja"))
