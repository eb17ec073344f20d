"""Many recipes: their ranges, the table that holds them, and a recipe and a slurry for each of its rows."""

import copy
import dataclasses
import math
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from slurrycast.analysis.quantity_names import tape_quantities
from slurrycast.config.composition import wet_composition
from slurrycast.config.dem_checks import SUM_TOLERANCE, particles_per_pg
from slurrycast.config.derived_runs import replicas, timestep_runs
from slurrycast.config.schema_errors import schema, schema_errors, shown
from slurrycast.config.slurry_table import Slurry, cell_value, read_cells, table_file
from slurrycast.dem import recipe
from slurrycast.explore.inputs import CONFIRMED, SHARE
from slurrycast.runtime.files import PASSED_OVER, InputError, check_unchanged

ROLE = "explored"  # of its slurries, which are none of the slurry table
DENSITY, SIZE = "density_g_cm3_", "size_factor_"
OF_DRYING = ("solvent_mass_fraction", "organics_density_g_cm3")
OTHER_COLUMNS = ("id", "confirm")  # columns of a table of recipes beside the inputs


@dataclasses.dataclass(frozen=True)
class Point:
    """A row of the table of recipes."""

    slurry: Slurry
    formulation: Mapping[str, Any]  # an entry of `formulations`
    inputs: Mapping[str, float]
    is_confirmed: bool  # by the full DEM
    place: str  # file and line


def is_on(config: Mapping) -> bool:
    """Whether the configuration asks for many recipes."""
    return bool(config["explore"]["ranges"] or config["explore"]["recipes"])


def table_path(config: Mapping) -> Path:
    """Path of the table of recipes: the user's own, as `table_file` finds it, or that of the design."""
    own = config["explore"]["recipes"]
    return table_file(own) if own else Path(f"results/{config['run']['name']}/design.csv")


def inputs_allowed(config: Mapping) -> dict[str, Mapping]:
    """The schema of the values of each input that the recipe may differ in, by name."""
    settings = schema("config")["properties"]
    (phase,) = settings["formulation"]["properties"]["phases"]["patternProperties"].values()
    of_phase = {
        SHARE: phase["properties"]["mass_fraction"],
        DENSITY: phase["properties"]["density_g_cm3"],
        SIZE: {"type": "number", "minimum": 0.1, "maximum": 10},
    }
    allowed = {f"{kind}{name}": rule for kind, rule in of_phase.items() for name in config["formulation"]["phases"]}
    return allowed | {name: settings["drying"]["properties"][name] for name in OF_DRYING}


def share_total(config: Mapping, inputs: Sequence[str]) -> float:
    """What the mass fractions among `inputs` sum to: 1 less those of the other phases."""
    phases = config["formulation"]["phases"]
    return 1 - math.fsum(phases[name]["mass_fraction"] for name in phases if f"{SHARE}{name}" not in inputs)


def with_points(config: Mapping, points: Sequence[Point]) -> dict:
    """The configuration with the recipes of the points among its formulations."""
    return {**config, "formulations": config["formulations"] | {p.slurry.id: p.formulation for p in points}}


def ranges(config: Mapping, _) -> Iterator[str]:
    """Each range is one of an input, and the mass fractions in theirs can have the sum that they have to keep."""
    key, given, allowed = "explore.ranges", config["explore"]["ranges"], inputs_allowed(config)
    sound = True
    for name, (low, high) in given.items():
        problem = None
        if name not in allowed:
            problem = f"must be an input of phases {', '.join(config['formulation']['phases'])}"
        elif wrong := [what for end in (low, high) for what in _value_errors(name, end, allowed[name])]:
            problem = wrong[0]
        elif low >= high:
            problem = "the lowest value must be below the highest; an input that does not vary is left out"
        if problem:
            sound = False
            yield f"{key}.{name} = {shown([low, high])}: {problem}"
    shares = {name: given[name] for name in given if name.startswith(SHARE)}
    if not sound or not shares:
        return
    total = share_total(config, shares)
    least, most = (math.fsum(ends) for ends in zip(*shares.values(), strict=True))
    if len(shares) == 1:
        yield f"{key}: {next(iter(shares))} alone: must be two mass fractions or more, since all sum to 1"
    elif not least + SUM_TOLERANCE < total < most - SUM_TOLERANCE:
        yield (
            f"{key}: {', '.join(shares)}: sum to {least:.6g} to {most:.6g}: must have {total:.6g} in between, what the "
            "other phases leave of 1"
        )


def enough_points(config: Mapping, _) -> Iterator[str]:
    """A design has enough points to fit models to."""
    settings = config["explore"]
    if settings["ranges"] and not settings["recipes"] and settings["points"] < (least := _fewest(settings["ranges"])):
        yield (
            f"explore.points = {settings['points']}: must be at least {least}, two more than inputs of explore.ranges "
            "that vary freely"
        )


def properties(config: Mapping, _) -> Iterator[str]:
    """The properties are measured on tapes, and the target names some of them."""
    settings, measured = config["explore"], config["microstructure"]
    known = tape_quantities(
        list(config["formulation"]["phases"]),
        config["drying"]["phase"],
        measured["tortuosity_spacings_um"],
        measured["tortuosity_axes"],
        measured["tortuosity_of"],
        measured["tortuosity_extrapolated"],
    )
    for name in settings["properties"]:
        if name not in known:
            yield f"explore.properties: {shown(name)}: must be one of {', '.join(known)}"
    for name in settings["target"]:
        if name not in settings["properties"]:
            yield f"explore.target.{name}: must be one of explore.properties, {', '.join(settings['properties'])}"
    if is_on(config) and "direct" not in config["surrogate"]["names"]:
        yield f"surrogate.names = {shown(config['surrogate']['names'])}: must have direct, which explore uses"


def _value_errors(name: str, value: Any, rule: Mapping) -> list[str]:
    """What is wrong with the value of an input, for the end of a line."""
    errors = schema_errors({name: value}, {"properties": {name: rule}}, hint=lambda *_: "")
    return [what.partition(": ")[2] for _, what in errors]


def read_points(config: Mapping, slurries: Sequence[Slurry]) -> tuple[list[Point], list[str]]:
    """The good rows of the table of recipes, and a line for each problem; neither if there is no table yet.

    Parameters
    ----------
    config
        The configuration, as it is written: not the one of `wet_composition`.
    slurries
        The slurry table.
    """
    path = table_path(config)
    if not is_on(config) or not (config["explore"]["recipes"] or path.exists()):
        return [], []
    if not config["explore"]["recipes"]:
        try:
            check_unchanged(path)
        except InputError:
            return [], [f"{path}: was edited: save it under another path, and name that in explore.recipes"]
    rows, lines = read_cells(path, ",")
    if lines:
        return [], lines
    (_, header), *body = rows or [(1, [])]
    allowed = inputs_allowed(config)
    inputs = [name for name in header if name not in OTHER_COLUMNS]
    unknown = [name for name in inputs if name not in allowed]
    if "id" not in header or not inputs or unknown or len(set(header)) < len(header):
        return [], [
            f"{path} line 1: {shown((unknown or header or ['nothing'])[0])}: must be the columns id, inputs of "
            f"{', '.join(allowed)}, and where wanted confirm, separated by commas"
        ]
    points, taken = [], {slurry.id: f"in {config['slurries']}" for slurry in slurries}
    taken |= dict.fromkeys(config["formulations"], "in formulations")
    taken |= {run.id: "among derived runs" for run in [*replicas(config, slurries), *timestep_runs(config, slurries)]}
    for number, cells in body:
        place = f"{path} line {number}"
        if len(cells) != len(header):
            lines.append(f"{place}: {len(cells)} cells: must be {len(header)}, separated by commas")
            continue
        row = dict(zip(header, cells, strict=True))
        wrong = list(_row_errors(config, row, inputs, allowed, taken))
        lines += [f"{place}: {line}" for line in wrong]
        if not wrong:
            values = {name: float(row[name]) for name in inputs}
            taken[row["id"]] = f"on line {number}"
            points.append(_point(config, row["id"], values, row.get("confirm") == CONFIRMED, place))
    lines += _too_few(points, path) if not lines else []
    return points, lines


def _row_errors(
    config: Mapping, row: Mapping[str, str], inputs: Sequence[str], allowed: Mapping, taken: Mapping[str, str]
) -> Iterator[str]:
    """What is wrong with a row of the table of recipes."""
    name, confirm = row["id"], row.get("confirm", "")
    if not re.fullmatch(r"[A-Za-z0-9_]{1,50}", name):
        yield f"id = {shown(name)}: must be text of at most 50 letters, digits and '_'"
    elif PASSED_OVER.fullmatch(name):
        yield f"id = {shown(name)}: must not be logs, begin with work or end with _work"
    elif name in taken:
        yield f"id = {shown(name)}: must be another one, it stands {taken[name]} too"
    if confirm not in ("", CONFIRMED):
        yield f"confirm = {shown(confirm)}: must be {CONFIRMED} or empty"
    values = {column: cell_value(row[column], allowed[column]) for column in inputs}
    wrong = [
        f"{column} = {shown(value)}: {what}"
        for column, value in values.items()
        for what in _value_errors(column, value, allowed[column])
    ]
    shares = [column for column in inputs if column.startswith(SHARE)]
    if not wrong and shares:
        total, is_total = share_total(config, shares), math.fsum(values[column] for column in shares)
        if abs(is_total - total) > SUM_TOLERANCE:
            yield f"{' + '.join(shares)} = {is_total:.8g}: must be {total:.8g} within {SUM_TOLERANCE:g}"
    yield from wrong


def _too_few(points: Sequence[Point], path: Path) -> Iterator[str]:
    """Some input varies, and recipes are enough to fit a model to."""
    columns = {name: {point.inputs[name] for point in points} for name in points[0].inputs} if points else {}
    varied = [name for name, values in columns.items() if len(values) > 1]
    single = list(Counter(tuple(point.inputs.values()) for point in points).values()).count(1)
    if single < (least := _fewest(varied)):
        yield (
            f"{path}: {single} recipes that no other row repeats: must be at least {least}, two more than inputs that "
            "vary freely"
        )


def _fewest(varied: Sequence[str]) -> int:
    """How many recipes a fit over these inputs needs; repeated ones tell the noise alone."""
    return max(len(varied) - any(name.startswith(SHARE) for name in varied), 1) + 2


def _point(config: Mapping, id: str, inputs: Mapping[str, float], is_confirmed: bool, place: str) -> Point:
    """The recipe and the slurry of a row with these inputs."""
    phases = copy.deepcopy(config["formulation"]["phases"])
    for name, phase in phases.items():
        phase["mass_fraction"] = inputs.get(f"{SHARE}{name}", phase["mass_fraction"])
        phase["density_g_cm3"] = inputs.get(f"{DENSITY}{name}", phase["density_g_cm3"])
        for size_class in phase["size_classes"]:
            size_class["diameter_um"] *= inputs.get(f"{SIZE}{name}", 1.0)
    drying = {name: inputs[name] for name in OF_DRYING if name in inputs}
    own = {**config, "formulation": config["formulation"] | {"phases": phases}, "drying": config["drying"] | drying}
    settings, wet = config["explore"], wet_composition(own)["formulation"]["phases"]
    mass_pg = settings["particles"] / sum(particles_per_pg(recipe.particle_types(wet)))
    formulation = {"unit_mass_pg": mass_pg, "phases": phases} | ({"drying": drying} if drying else {})
    seed = recipe.derived_seed(settings["seed"], f"recipe {id}")
    slurry = Slurry(id, ROLE, 1.0, settings["thickness_ratio"], seed, formulation=id)
    return Point(slurry, formulation, inputs, is_confirmed, place)
