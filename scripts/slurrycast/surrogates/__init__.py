"""The surrogates: what jumps from early frames to the equilibrated one, learned or not.

A surrogate is a module (or a package) with a subclass of `base.Surrogate`, and a line in `registry.NAMES`.
docs/surrogates.md shows how to add one. A run names surrogates by labels, see `labels`.
"""

from slurrycast.surrogates.labels import Label, family, main_labels, parse
from slurrycast.surrogates.registry import NAMES, load

__all__ = ["NAMES", "Label", "family", "load", "main_labels", "parse"]
