"""Draw the workflow as a diagram (the reference article's Fig. 1) from the rules themselves.

In: the graph of the rules in DOT, as `snakemake --rulegraph` prints it.
Out: PNG with one box for each rule, in layers from the recipe at the top to the report at the bottom. Arrows that
follow from others are left out, and so are the rules named by --hide.
"""

import re
from collections.abc import Collection
from graphlib import CycleError, TopologicalSorter
from itertools import pairwise

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch, PathPatch
from matplotlib.path import Path as Curve
from scipy.optimize import isotonic_regression

from slurrycast.report.figures import INK, new_figure, save_figure
from slurrycast.runtime.command_line import Namespace, Parser, run_main
from slurrycast.runtime.files import InputError

# part of the workflow by the verb that a rule's name starts with
PARTS = {
    "DEM": ("#e4e9ee", {"generate", "run", "extract"}),
    "surrogate": ("#fbe6d2", {"assemble", "train", "fit", "adopt", "describe", "predict", "tune"}),
    "hybrid": ("#d3ebec", {"wrap", "relax"}),
    "tape": ("#dfeed6", {"dry", "calibrate"}),
    "analysis": ("#e9e4f1", {"measure", "check", "compare", "compute", "tabulate", "collect", "judge", "confirm"}),
    "report": ("#f3f0e2", {"plot", "render", "write"}),
}
OTHER = "#ffffff"
BOX_WIDTH, BOX_HEIGHT = 1.0, 0.52
LANE_WIDTH = 0.28  # of an arrow that passes a layer
GAP, LAYER_HEIGHT = 0.16, 1.0
SWEEPS = 24

Node = str | tuple[str, str, int]  # a rule, or where the arrow between two rules passes a layer


def _cycle(parents: dict[str, set[str]]) -> list[str]:
    """Rules of a cycle in the order of its arrows, the first one again at the end; empty if there is none."""
    try:
        TopologicalSorter(parents).prepare()
    except CycleError as error:
        return error.args[1]
    return []


def read_rule_graph(text: str, hidden: Collection[str] = ()) -> dict[str, set[str]]:
    """Parents of each rule in a DOT graph, without the rules in `hidden`. InputError if there is none or a cycle.

    A cycle that goes through a rule of analysis is none: its arrow to that rule is left out.
    """
    names = dict(re.findall(r'^\s*(\d+)\s*\[\s*label\s*=\s*"([^"\\]+)', text, re.M))
    parents = {name: set() for name in names.values() if name not in hidden}
    for parent, child in re.findall(r"^\s*(\d+)\s*->\s*(\d+)", text, re.M):
        if names[parent] in parents and names[child] in parents:
            parents[names[child]].add(names[parent])
    if not parents:
        raise InputError("the rule graph holds no rule: expected the output of `snakemake --rulegraph`")
    while cycle := _cycle(parents):
        # what is measured on some slurries may be an input of the same rules for others
        back = [(before, rule) for before, rule in pairwise(cycle) if rule.partition("_")[0] in PARTS["analysis"][1]]
        if not back:
            raise InputError(f"the rule graph has a cycle: {' -> '.join(cycle)}")
        before, rule = back[0]
        parents[rule].remove(before)
    return parents


def without_implied_edges(parents: dict[str, set[str]]) -> dict[str, set[str]]:
    """Drop every edge that a longer way through the graph implies (transitive reduction)."""
    ancestors: dict[str, set[str]] = {}
    for rule in TopologicalSorter(parents).static_order():
        ancestors[rule] = parents[rule].union(*(ancestors[parent] for parent in parents[rule]))
    return {
        rule: {p for p in parents[rule] if not any(p in ancestors[other] for other in parents[rule])}
        for rule in parents
    }


def layers_of(parents: dict[str, set[str]]) -> dict[str, int]:
    """Layer of each rule: one below its lowest parent; rules without parents stand right above their first child."""
    layer: dict[str, int] = {}
    order = list(TopologicalSorter(parents).static_order())
    for rule in order:
        layer[rule] = max((layer[parent] + 1 for parent in parents[rule]), default=0)
    for rule in reversed(order):
        below = [layer[child] for child in parents if rule in parents[child]]
        if below and not parents[rule]:
            layer[rule] = min(below) - 1
    return layer


def chains(parents: dict[str, set[str]], layer: dict[str, int]) -> list[list[Node]]:
    """One chain for each edge: the parent, a lane in each layer that the arrow passes, the child."""
    return [
        [parent, *((parent, child, at) for at in range(layer[parent] + 1, layer[child])), child]
        for child in sorted(parents)
        for parent in sorted(parents[child])
    ]


def _width(node: Node) -> float:
    return BOX_WIDTH if isinstance(node, str) else LANE_WIDTH


def _spread(row: list[Node], wanted: dict[Node, float]) -> dict[Node, float]:
    """Places nearest to the wanted ones that keep the order of `row` and do not overlap."""
    offsets = np.concatenate([[0.0], np.cumsum([(_width(a) + _width(b)) / 2 + GAP for a, b in pairwise(row)])])
    rising = isotonic_regression([wanted[node] for node in row] - offsets).x
    return dict(zip(row, rising + offsets, strict=True))


def place_nodes(parents: dict[str, set[str]]) -> tuple[dict[Node, tuple[float, float]], list[list[Node]]]:
    """Place (x, y) of each rule and lane, and the chain of each arrow.

    Layered drawing after Sugiyama, Tagawa and Toda (1981): sweeps down and up order each layer by the mean place of the
    neighbours in the layer before.
    """
    layer = layers_of(parents)
    arrows = chains(parents, layer)
    rows: list[list[Node]] = [[] for _ in range(max(layer.values()) + 1)]
    neighbours: dict[Node, list[Node]] = {}
    level = dict(layer)
    for rule in sorted(layer):
        rows[layer[rule]].append(rule)
        neighbours[rule] = []
    for chain in arrows:
        for at, node in enumerate(chain[1:-1], layer[chain[0]] + 1):
            rows[at].append(node)
            level[node] = at
            neighbours[node] = []
        for above, below in pairwise(chain):
            neighbours[above].append(below)
            neighbours[below].append(above)
    x: dict[Node, float] = {}
    for row in rows:
        x.update(_spread(row, dict.fromkeys(row, 0.0)))
    best, fewest = dict(x), np.inf
    for sweep in range(SWEEPS):
        down = sweep % 2 == 0
        for at in range(len(rows)) if down else reversed(range(len(rows))):
            wanted = {}
            for node in rows[at]:
                near = [x[n] for n in neighbours[node] if (level[n] < at) == down]
                wanted[node] = float(np.mean(near)) if near else x[node]
            rows[at].sort(key=wanted.get)
            x.update(_spread(rows[at], wanted))
        crossings = _crossings(arrows, x, level)
        if crossings <= fewest:
            best, fewest = dict(x), crossings
    return {node: (best[node], -level[node] * LAYER_HEIGHT) for node in best}, arrows


def _crossings(arrows: list[list[Node]], x: dict[Node, float], level: dict[Node, int]) -> int:
    links = sorted({(level[a], x[a], x[b]) for chain in arrows for a, b in pairwise(chain)})
    return sum(
        first[0] == second[0] and (first[1] - second[1]) * (first[2] - second[2]) < 0
        for i, first in enumerate(links)
        for second in links[i + 1 :]
    )


def _colour(rule: str) -> str:
    verb = rule.split("_")[0]
    return next((colour for colour, verbs in PARTS.values() if verb in verbs), OTHER)


def _two_lines(rule: str) -> str:
    words = rule.split("_")
    half = min(range(1, len(words) + 1), key=lambda cut: max(len(" ".join(words[:cut])), len(" ".join(words[cut:]))))
    return "\n".join(part for part in (" ".join(words[:half]), " ".join(words[half:])) if part)


def draw_workflow(parents: dict[str, set[str]]) -> Figure:
    """Draw the rules and their arrows."""
    places, arrows = place_nodes(without_implied_edges(parents))
    xs, ys = np.array(list(places.values())).T
    left, right, low, high = xs.min() - 0.6, xs.max() + 0.6, ys.min() - 0.4, ys.max() + 0.4
    scale_in = 1.12
    figure = new_figure((right - left) * scale_in, (high - low) * scale_in * 0.78 + 0.4)
    axes = figure.subplots()
    axes.set(xlim=(left, right), ylim=(low, high))
    axes.axis("off")
    for chain in arrows:
        vertices, codes = [], []
        for above, below in pairwise(chain):
            (x0, y0), (x1, y1) = places[above], places[below]
            y0 -= BOX_HEIGHT / 2
            y1 += BOX_HEIGHT / 2
            middle = (y0 + y1) / 2
            codes += [Curve.LINETO if vertices else Curve.MOVETO, *[Curve.CURVE4] * 3]
            vertices += [(x0, y0), (x0, middle), (x1, middle), (x1, y1)]
        axes.add_patch(PathPatch(Curve(vertices, codes), fc="none", ec="#8895a1", lw=1.1, zorder=1))
        tip = vertices[-1]
        head = {"arrowstyle": "-|>", "color": "#8895a1", "lw": 0, "shrinkA": 0, "shrinkB": 0, "mutation_scale": 11}
        axes.annotate("", tip, (tip[0], tip[1] + 0.09), arrowprops=head)
    for node, (x, y) in places.items():
        if isinstance(node, str):
            corner = (x - BOX_WIDTH / 2, y - BOX_HEIGHT / 2)
            style = {"boxstyle": "round,pad=0,rounding_size=0.08", "fc": _colour(node), "ec": INK, "lw": 0.9}
            axes.add_patch(FancyBboxPatch(corner, BOX_WIDTH, BOX_HEIGHT, zorder=2, **style))
            axes.text(x, y, _two_lines(node), ha="center", va="center", fontsize=10, zorder=3, linespacing=1.15)
    used = [(part, colour) for part, (colour, _) in PARTS.items() if colour in map(_colour, parents)]
    handles = [FancyBboxPatch((0, 0), 1, 1, fc=colour, ec=INK, lw=0.8, label=part) for part, colour in used]
    figure.legend(handles=handles, loc="outside upper center", ncols=len(used), fontsize=10)
    return figure


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_input("--rulegraph", "DOT file from `snakemake --rulegraph`")
    parser.add_value("--hide", "rules that are not stages (default: all)", nargs="*", default=["all"])
    parser.add_output("--figure", "PNG")


def main(args: Namespace) -> None:
    """Read the graph and draw it."""
    parents = read_rule_graph(args.rulegraph.read_text(encoding="utf-8"), args.hide)
    save_figure(draw_workflow(parents), args.figure)


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
