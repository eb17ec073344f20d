"""What a run may ask for: the configuration and the slurry table, checked before any job, all errors at once.

The Snakefile imports this module when it is parsed, so its imports stay light. What the schemas in workflow/schemas say
is not repeated here; the checks below are those that a schema cannot express. Paths are relative to the working
directory.
"""

import csv
import dataclasses
import difflib
import functools
import itertools
import json
import math
import re
import shlex
import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import jsonschema
import yaml

from slurrycast import surrogates
from slurrycast.dem import forcefield, recipe
from slurrycast.runtime.files import InputError

ROOT = Path(__file__).resolve().parents[3]
SUM_TOLERANCE = 1e-6  # of fractions that sum to 1: room for thirds written with seven digits

# Settings of `dem` that leave its results as they are: how it is started, and bounds that are only checked. All others
# count as physics, also those that set which files are kept and where a run is cut into segments: a run holds one set.
DEM_NOT_PHYSICS = frozenset(
    {
        "executable",
        "launcher",
        "ranks",
        "budget_min",
        "max_rayleigh_share",
        "max_hertz_share",
        "impact_speed_um_us",
        "max_density_drift",
    }
)


class ConfigurationError(InputError):
    """Every problem of a configuration or a slurry table, in `lines`: one a problem."""

    def __init__(self, lines: Sequence[str]):
        super().__init__("\n".join(lines))
        self.lines = list(lines)


@dataclasses.dataclass(frozen=True)
class Slurry:
    """A row of the slurry table, or a run that follows from one; `dem` then holds the settings in which it differs."""

    id: str
    role: str
    mass_units: float  # in formulation.unit_mass_pg
    thickness_ratio: float  # Lz / Lx
    seed: int
    dem: Mapping[str, Any] = dataclasses.field(default_factory=dict)


# ---- schemas


def _is_whole(_, value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def _is_finite(_, value: Any) -> bool:
    return _is_whole(_, value) or (isinstance(value, float) and math.isfinite(value))


# JSON Schema takes 2.0 for an integer, and Python takes NaN for a number.
_Validator = jsonschema.validators.extend(
    jsonschema.Draft202012Validator,
    type_checker=jsonschema.Draft202012Validator.TYPE_CHECKER.redefine_many(
        {"integer": _is_whole, "number": _is_finite}
    ),
)


@functools.cache
def schema(name: str) -> dict:
    """The schema workflow/schemas/`name`.schema.yaml."""
    return yaml.safe_load((ROOT / "workflow" / "schemas" / f"{name}.schema.yaml").read_text(encoding="utf-8"))


def allowed(rule: Mapping) -> str:
    """Say in words what the schema `rule` allows."""
    if "allowed" in rule:
        return rule["allowed"]
    if "enum" in rule:
        return "one of " + ", ".join(rule["enum"])
    kind = rule["type"]
    if kind == "object":
        return "a section with " + ", ".join(rule["properties"])
    words = {
        "integer": "a whole number",
        "number": "a number",
        "boolean": "true or false",
        "string": "text that is not empty",
    }
    bounds = {"exclusiveMinimum": "above", "minimum": "at least", "exclusiveMaximum": "below", "maximum": "at most"}
    range_ = " and ".join(f"{word} {rule[bound]:.12g}" for bound, word in bounds.items() if bound in rule)
    return f"{words[kind]} {range_}".rstrip()


def _shown(value: Any) -> str:
    """A value as it is written in YAML or JSON, shortened to fit on a line."""
    text = json.dumps(value, default=str, ensure_ascii=False)
    return text if len(text) <= 60 else f"{text[:57]}..."


def _printable(line: str) -> str:
    """A line as it can be printed on one: what ends lines or steers a terminal is written as an escape."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in line)


def _is_file(path: str) -> bool:
    """Whether a file exists at any text that may be a path."""
    try:
        return Path(path).is_file()
    except (OSError, ValueError):  # too long, or with a character that no path has
        return False


def _hint(value: Any, rule: Mapping) -> str:
    """What to write instead, where YAML has read something else than was meant."""
    kind = rule.get("type")
    if kind == "string" and value is not None and not isinstance(value, str | list | Mapping):
        return " (put it in quotes to make it text)"
    if kind not in ("number", "integer") or not isinstance(value, str) or len(value) > 30:
        return ""
    number = re.fullmatch(r"([-+]?\d+)(\.\d*)?(?:[eE]([-+]?)(\d{1,3}))?", value.strip(), re.ASCII)
    if not number:
        return ""
    whole, fraction, sign, power = number.groups()
    if kind == "integer" and not float(value).is_integer():
        return ""
    if power is None:
        return f" (it is text: write {value.strip()} without quotes)"
    # YAML 1.1 wants both a point and a sign of the exponent
    point = fraction if fraction and fraction != "." else ".0"
    as_yaml = f"{float(value):.0f}" if kind == "integer" else f"{whole}{point}e{sign or '+'}{power}"
    return f" ({value.strip()} is text in YAML: write {as_yaml})"


def _with_text_keys(value: Any, path: str, lines: list[str]) -> Any:
    """Copy `value` with all keys as text, and report each key that was not: YAML reads `no:` as false and `8:` as 8."""
    if isinstance(value, Mapping):
        lines += [
            f"{path or 'configuration'}: key {_shown(key)} is not text: put it in quotes"
            for key in value
            if not isinstance(key, str)
        ]
        return {str(k): _with_text_keys(v, f"{path}.{k}".lstrip("."), lines) for k, v in value.items()}
    if isinstance(value, list):
        return [_with_text_keys(item, f"{path}[{i}]", lines) for i, item in enumerate(value)]
    return value


def _key_path(parts: Sequence[str | int]) -> str:
    """`a.b[0].c` of the parts a, b, 0, c."""
    return "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in parts).lstrip(".")


def _schema_errors(value: Any, rule: Mapping, hint: Callable[[Any, Mapping], str] = _hint) -> Iterator[tuple[str, str]]:
    """Yield (key path, what is wrong with it) for each way in which `value` breaks the schema `rule`."""
    for error in _Validator(rule).iter_errors(value):
        path, rule_there, found = list(error.absolute_path), error.schema, error.instance
        if error.validator == "required":
            for key in (key for key in rule_there["required"] if key not in found):
                yield _key_path([*path, key]), f"missing: must be {allowed(rule_there['properties'][key])}"
        elif error.validator == "additionalProperties":
            known = list(rule_there.get("properties", {}))
            patterns = rule_there.get("patternProperties", {})
            for key in found:
                if key not in known and not any(re.search(pattern, key) for pattern in patterns):
                    close = difflib.get_close_matches(key, known, 1)
                    guess = f" (do you mean {close[0]}?)" if close else ""
                    may_be = f"one of {', '.join(known)}" if known else rule_there["allowed"]
                    yield _key_path([*path, key]), f"unknown key: must be {may_be}{guess}"
        else:
            place = _key_path(path) or "configuration"
            yield place, f"{_shown(found)}: must be {allowed(rule_there)}{hint(found, rule_there)}"


# ---- slurry table


def _cell(text: str, rule: Mapping) -> str | int | float:
    """The value of a cell; text that is no number stays text, which the schema then refuses."""
    try:
        if rule["type"] == "integer" and re.fullmatch(r"[-+]?\d+", text, re.ASCII):
            return int(text)
        if rule["type"] == "number" and re.fullmatch(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?", text, re.ASCII):
            return float(text)
    except ValueError:  # thousands of digits
        pass
    return text


def _read_table(path: str | Path) -> tuple[list[Slurry], list[str]]:
    """Read the slurry table: the good rows, and a line for each problem."""
    try:
        # utf-8-sig: spreadsheet programs put a byte order mark in front
        text = Path(path).read_text(encoding="utf-8-sig")
    except (OSError, ValueError) as error:
        return [], [f"{path}: cannot be read: {getattr(error, 'strerror', None) or error}"]
    reader = csv.reader(text.splitlines(), delimiter="\t")
    try:
        rows = [(reader.line_num, [cell.strip() for cell in row]) for row in reader if any(map(str.strip, row))]
    except csv.Error as error:
        return [], [f"{path} line {reader.line_num}: {error}: must be cells separated by tabs"]
    columns = schema("slurries")["properties"]
    if not rows or sorted(rows[0][1]) != sorted(columns):
        found = _shown("\t".join(rows[0][1])) if rows else "nothing"
        return [], [f"{path} line 1: {found}: must be the columns {', '.join(columns)}, separated by tabs"]
    (_, header), *body = rows
    slurries, lines = [], []
    seen: dict[tuple[str, Any], int] = {}
    for number, cells in body:
        place = f"{path} line {number}"
        if len(cells) != len(header):
            lines.append(f"{place}: {len(cells)} cells: must be {len(header)}, separated by tabs")
            continue
        row = {name: _cell(cell, columns[name]) for name, cell in zip(header, cells, strict=True)}
        errors = _schema_errors(row, schema("slurries"), hint=lambda *_: "")  # a cell is not read by YAML
        wrong = [f"{place}: {column} = {what}" for column, what in errors]
        for column in ("id", "seed"):
            first = seen.setdefault((column, row[column]), number)
            if first != number:
                wrong.append(f"{place}: {column} = {_shown(row[column])}: must differ from line {first}")
        lines += wrong
        if not wrong:
            slurries.append(Slurry(**row))
    if not body:
        lines.append(f"{path}: no slurries: must be at least one row below the column names")
    return slurries, lines


def read_slurries(path: str | Path) -> list[Slurry]:
    """Read the slurry table; raises ConfigurationError with a line for each problem (file, line, column, value)."""
    slurries, lines = _read_table(path)
    if lines:
        raise ConfigurationError(lines)
    return slurries


# ---- checks across keys: each yields a line for each problem


def _commands(config: Mapping, _) -> Iterator[str]:
    for key in ("executable", "launcher"):
        command = config["dem"][key]
        try:
            if not shutil.which(command):  # not one program: its words are taken apart
                shlex.split(command)
        except ValueError as error:  # an open quote, or a character that no path has
            yield f"dem.{key} = {_shown(command)}: {str(error).lower()}: must be a program, or one with its options"


def _fractions(config: Mapping, _) -> Iterator[str]:
    phases = config["formulation"]["phases"]
    total = math.fsum(phase["mass_fraction"] for phase in phases.values())
    if abs(total - 1) > SUM_TOLERANCE:
        yield f"formulation.phases: mass fractions sum to {total:.8g}: must be 1 within {SUM_TOLERANCE:g}"
    for name, phase in phases.items():
        total = math.fsum(size_class["number_fraction"] for size_class in phase["size_classes"])
        if abs(total - 1) > SUM_TOLERANCE:
            place = f"formulation.phases.{name}.size_classes"
            yield f"{place}: number fractions sum to {total:.8g}: must be 1 within {SUM_TOLERANCE:g}"


def _packing(config: Mapping, _) -> Iterator[str]:
    formulation = config["formulation"]
    expected = formulation["expected_density_g_cm3"]
    # specific volumes add up: the share of the final box that the particles fill
    final = expected * sum(p["mass_fraction"] / p["density_g_cm3"] for p in formulation["phases"].values())
    if final >= 1:
        yield (
            f"formulation.expected_density_g_cm3 = {_shown(expected)}: must be below {expected / final:.4g}, "
            "the density of the particles without space between them"
        )
    start = formulation["initial_packing_fraction"]
    if start >= final:
        yield (
            f"formulation.initial_packing_fraction = {_shown(start)}: must be below {final:.4g}, the packing fraction "
            "at formulation.expected_density_g_cm3, since the box shrinks"
        )


def _and_more(count: int) -> str:
    """What ends a line that stands for `count` slurries."""
    return f" (and {count - 1} more slurries)" if count > 1 else ""


def _whole_particles(config: Mapping, slurries: Sequence[Slurry]) -> Iterator[str]:
    types = recipe.particle_types(config["formulation"]["phases"])
    lacking = []
    for slurry in slurries:
        mass_pg = slurry.mass_units * config["formulation"]["unit_mass_pg"]
        counts = recipe.particle_counts(types, mass_pg)
        absent = [f"{t.phase} {t.diameter_um:g} um" for t, count in zip(types, counts, strict=True) if count == 0]
        if absent:
            lacking.append((mass_pg, slurry.id, ", ".join(absent)))
    if lacking:
        mass_pg, slurry_id, absent = min(lacking)
        yield (
            f"formulation.unit_mass_pg: slurry {slurry_id} of {mass_pg:.6g} pg has no particle of {absent}: must be "
            f"enough mass for one of each size class{_and_more(len(lacking))}"
        )


def _shortest_edges(config: Mapping, slurries: Sequence[Slurry]) -> list[tuple[float, str]]:
    """Shortest edge in um that each slurry is expected to end with, and its id."""
    formulation = config["formulation"]
    pg_per_unit_um3 = formulation["unit_mass_pg"] / formulation["expected_density_g_cm3"]
    return [
        (min(recipe.box_edges_um(slurry.mass_units * pg_per_unit_um3, slurry.thickness_ratio)), slurry.id)
        for slurry in slurries
    ]


def _box_edges(config: Mapping, slurries: Sequence[Slurry]) -> Iterator[str]:
    formulation, skin_um = config["formulation"], config["dem"]["skin_um"]
    types = recipe.particle_types(formulation["phases"])
    cutoff_um = forcefield.largest_cutoff_um(types, config["force_field"]["lennard_jones"])
    least_um = 2 * (cutoff_um + skin_um)
    narrow = [(edge_um, slurry_id) for edge_um, slurry_id in _shortest_edges(config, slurries) if edge_um <= least_um]
    if narrow:
        edge_um, slurry_id = min(narrow)
        yield (
            f"formulation.unit_mass_pg: slurry {slurry_id} ends with a shortest edge of {edge_um:.4g} um: must be "
            f"above {least_um:.4g} um, twice the largest cutoff {cutoff_um:.4g} (cutoff_factor) and the skin "
            f"{skin_um:.4g}{_and_more(len(narrow))}"
        )


def _attraction(config: Mapping, _) -> Iterator[str]:
    lennard_jones = config["force_field"]["lennard_jones"]
    sigma, cutoff = lennard_jones["sigma_factor"], lennard_jones["cutoff_factor"]
    if sigma >= cutoff:
        yield (
            f"force_field.lennard_jones.sigma_factor = {_shown(sigma)}: must be below cutoff_factor = {_shown(cutoff)}"
        )


def _timestep(config: Mapping, _) -> Iterator[str]:
    dem = config["dem"]
    types = recipe.particle_types(config["formulation"]["phases"])
    stiffness_kpa = config["force_field"]["granular_hertz"]["normal_stiffness_kpa"]
    times_us = {
        "rayleigh": forcefield.rayleigh_time_us(types, stiffness_kpa),
        "hertz": forcefield.hertz_time_us(types, stiffness_kpa, dem["impact_speed_um_us"]),
    }
    for name, time_us in times_us.items():
        share, most = dem["timestep_us"] / time_us, dem[f"max_{name}_share"]
        if share > most:
            yield (
                f"dem.timestep_us = {_shown(dem['timestep_us'])}: {share:.3g} of the {name.capitalize()} time "
                f"{time_us:.4g} us: must be at most {most * time_us:.4g}, dem.max_{name}_share = {_shown(most)} of it"
            )


def _steps(config: Mapping, _) -> Iterator[str]:
    dem = config["dem"]
    steps, intervals, thermo = dem["steps"], dem["frames"] - 1, dem["thermo_every_steps"]
    if steps % intervals:
        yield f"dem.steps = {steps}: must be a multiple of dem.frames - 1 = {intervals}"
    elif (steps // intervals) % thermo:
        yield f"dem.thermo_every_steps = {thermo}: must divide the {steps // intervals} steps between two frames"
    if dem["segment_frames"] > intervals:
        yield f"dem.segment_frames = {dem['segment_frames']}: must be at most dem.frames - 1 = {intervals}"


def _frames(config: Mapping, _) -> Iterator[str]:
    last = config["dem"]["frames"] - 1
    restarts, inputs = config["dem"]["restart_frames"], config["learning"]["input_frames"]
    target = config["learning"]["target_frame"]
    for place, frames in (("dem.restart_frames", restarts), ("learning.input_frames", inputs)):
        if any(a >= b for a, b in itertools.pairwise(frames)):
            yield f"{place} = {_shown(frames)}: must be strictly increasing"
        if max(frames) > last:
            yield f"{place} = {_shown(frames)}: must be at most dem.frames - 1 = {last}"
    absent = [frame for frame in inputs if frame not in restarts]
    if absent:
        yield f"learning.input_frames: {_shown(absent)} not in dem.restart_frames: must be a restart frame each"
    if not max(inputs) < target <= last:
        yield (
            f"learning.target_frame = {target}: must be after the last input frame {max(inputs)} and at most "
            f"dem.frames - 1 = {last}"
        )


def _roles(config: Mapping, slurries: Sequence[Slurry]) -> Iterator[str]:
    roles = {slurry.role for slurry in slurries}
    if "train" not in roles and config["surrogate"]["model"] is None:
        yield f"{config['slurries']}: no slurry of role train: must be at least one unless surrogate.model is given"
    if not roles & {"test", "new"}:
        yield f"{config['slurries']}: no slurry of role test or new: must be at least one"


def _labels(config: Mapping, _) -> Iterator[str]:
    names, further = config["surrogate"]["names"], config["evaluation"]["surrogates"]
    target = config["learning"]["target_frame"]
    for key, labels in (("surrogate.names", names), ("evaluation.surrogates", further)):
        for text in labels:
            try:
                label = surrogates.parse(text)
            except InputError as error:
                yield f"{key}: {str(error).removeprefix('surrogate: ')}"
                continue
            surrogate, last = surrogates.load(label.name), label.last_frame
            n_frames = min(len(config["learning"]["input_frames"]), target if last is None else last + 1)
            if n_frames < getattr(surrogate, "LEAST_FRAMES", 1):
                least = f"at least {surrogate.LEAST_FRAMES} input frames, it has {n_frames}"
                yield f"{key}: {_shown(text)}: must have {least}"
                continue
            if last is None:  # the last of the input frames
                continue
            if surrogate.LEARNS_FROM == "samples":
                yield f"{key}: {_shown(text)}: must be {label.name}, which learns from learning.input_frames only"
            elif not 0 < last < target:
                yield f"{key}: {_shown(text)}: its last input frame must be 1 to {target - 1}, before the target frame"
            elif surrogate.CONTINUES_DEM and last not in config["dem"]["restart_frames"]:
                yield f"{key}: {_shown(text)} starts at frame {last}: must be one of dem.restart_frames"
    for text in further:
        if text in names:
            yield f"evaluation.surrogates: {_shown(text)}: must not be in surrogate.names too"
    for text in config["report"]["pictures"]:
        if text not in names:
            yield f"report.pictures: {_shown(text)}: must be one of surrogate.names, {', '.join(names)}"


def _neighbours_cutoff(config: Mapping, slurries: Sequence[Slurry]) -> Iterator[str]:
    labels = [*config["surrogate"]["names"], *config["evaluation"]["surrogates"]]
    cutoff_um = config["surrogate"]["neighbours"]["cutoff_um"]
    if not any(label.partition("_")[0] == "neighbours" for label in labels) or not slurries:
        return
    edge_um, slurry_id = min(_shortest_edges(config, slurries))
    if cutoff_um > edge_um / 2:
        yield (
            f"surrogate.neighbours.cutoff_um = {_shown(cutoff_um)}: must be at most {edge_um / 2:.4g}, half the "
            f"shortest edge that slurry {slurry_id} ends with"
        )


def _intermediate_targets(config: Mapping, _) -> Iterator[str]:
    settings = config["surrogate"]["neighbours"]
    targets, layers = settings["intermediate_targets"], settings["layers"]
    key = f"surrogate.neighbours.intermediate_targets = {_shown(targets)}"
    if any(a >= b for a, b in itertools.pairwise(targets)):
        yield f"{key}: must be strictly increasing"
    if len(targets) >= layers:
        yield f"{key}: must be at most {layers - 1}, one for each of surrogate.neighbours.layers but the last"


def _model(config: Mapping, _) -> Iterator[str]:
    names, model = config["surrogate"]["names"], config["surrogate"]["model"]
    if model is None:
        return
    if not _is_file(model):
        yield f"surrogate.model = {_shown(model)}: no such file: must be null or a trained model.keras"
    try:
        kinds = {text: surrogates.load(surrogates.parse(text).name) for text in names}
    except InputError:
        return  # said elsewhere
    of_model = [text for text, surrogate in kinds.items() if surrogate.MODEL_FILE == "model.keras"]
    if len(of_model) != 1:
        yield (
            f"surrogate.names = {_shown(names)}: must hold one surrogate with a Keras model, the one that "
            "surrogate.model is of"
        )
    elif not without_training(config, of_model[0]):
        yield (
            f"surrogate.packing_fraction = null: must be a number for {of_model[0]} with surrogate.model: the training "
            "slurries, which would give it, are not run"
        )


def _model_of_this_run(config: Mapping, _) -> Iterator[str]:
    model, written = config["surrogate"]["model"], Path("results") / config["run"]["name"] / "models"
    if model is not None and _is_file(model) and Path(model).resolve().is_relative_to(written.resolve()):
        yield (
            f"surrogate.model = {_shown(model)}: must lie outside {written}, which this run writes: "
            "choose another run.name"
        )


def _derived_ids(config: Mapping, slurries: Sequence[Slurry]) -> Iterator[str]:
    ids = {slurry.id for slurry in slurries}
    for key, runs in (
        ("evaluation.replicated", replicas(config, slurries)),
        ("convergence.slurry", timestep_runs(config, slurries)),
    ):
        for run in runs:
            if run.id in ids:
                yield f"{key}: its run {run.id} is named like a slurry of the table: rename that slurry"


def _convergence(config: Mapping, _) -> Iterator[str]:
    steps_us, dem = config["convergence"]["timesteps_us"], config["dem"]
    wrong = [step for step in steps_us if abs(step * 1e6 - round(step * 1e6)) > 1e-6 or step < 1e-6]
    if wrong or any(a >= b for a, b in itertools.pairwise(steps_us)):
        yield f"convergence.timesteps_us = {_shown(steps_us)}: must be whole picoseconds (1.0e-6), increasing"
        return
    interval_us = dem["timestep_us"] * dem["thermo_every_steps"]
    for step in steps_us:
        if abs(interval_us / step - round(interval_us / step)) > 1e-6:
            yield (
                f"convergence.timesteps_us: {_shown(step)}: must divide dem.timestep_us x dem.thermo_every_steps = "
                f"{interval_us:.6g} us"
            )


def _cooling(config: Mapping, _) -> Iterator[str]:
    start_k, end_k = config["relaxation"]["start_temperature_k"], config["dem"]["temperature_k"]
    if start_k < end_k:
        yield (
            f"relaxation.start_temperature_k = {_shown(start_k)}: must be at least dem.temperature_k = "
            f"{_shown(end_k)}, to which it falls"
        )


def _steps_of(config: Mapping, _) -> Iterator[str]:
    labels = [*config["surrogate"]["names"], *config["evaluation"]["surrogates"]]
    for text in config["relaxation"]["steps_of"]:
        if text not in labels and text not in surrogates.NAMES:
            yield (
                f"relaxation.steps_of: {_shown(text)}: must be the name of a surrogate, {', '.join(surrogates.NAMES)}, "
                f"or a label of this run, {', '.join(labels)}"
            )


def _rdf_pair(config: Mapping, _) -> Iterator[str]:
    phases = list(config["formulation"]["phases"])
    for phase in config["analysis"]["rdf_pair"]:
        if phase not in phases:
            yield f"analysis.rdf_pair: {_shown(phase)}: must be one of {', '.join(phases)}"


# Each check with the keys that it reads: it is left out where the schema has found one of them wrong.
_CHECKS: list[tuple[Callable[[Mapping, Sequence[Slurry]], Iterator[str]], str]] = [
    (_commands, "dem.executable dem.launcher"),
    (_fractions, "formulation.phases"),
    (_packing, "formulation.phases formulation.expected_density_g_cm3 formulation.initial_packing_fraction"),
    (_whole_particles, "formulation.phases formulation.unit_mass_pg"),
    (
        _box_edges,
        "formulation.phases formulation.unit_mass_pg formulation.expected_density_g_cm3 "
        "force_field.lennard_jones.cutoff_factor dem.skin_um",
    ),
    (_attraction, "force_field.lennard_jones.sigma_factor force_field.lennard_jones.cutoff_factor"),
    (
        _timestep,
        "formulation.phases force_field.granular_hertz.normal_stiffness_kpa dem.timestep_us dem.impact_speed_um_us "
        "dem.max_rayleigh_share dem.max_hertz_share",
    ),
    (_steps, "dem.steps dem.frames dem.thermo_every_steps dem.segment_frames"),
    (_frames, "dem.frames dem.restart_frames learning.input_frames learning.target_frame"),
    (_roles, "slurries surrogate.model"),
    (
        _labels,
        "surrogate.names evaluation.surrogates report.pictures learning.input_frames learning.target_frame "
        "dem.restart_frames",
    ),
    (
        _neighbours_cutoff,
        "surrogate.names evaluation.surrogates surrogate.neighbours formulation.phases formulation.unit_mass_pg "
        "formulation.expected_density_g_cm3",
    ),
    (_intermediate_targets, "surrogate.neighbours"),
    (_model, "surrogate.names surrogate.model surrogate.packing_fraction"),
    (_model_of_this_run, "run surrogate.model"),
    (_convergence, "convergence.timesteps_us dem.timestep_us dem.thermo_every_steps"),
    (_derived_ids, "slurries evaluation convergence dem.timestep_us dem.steps dem.thermo_every_steps"),
    (_cooling, "relaxation.start_temperature_k dem.temperature_k"),
    (_steps_of, "relaxation.steps_of surrogate.names evaluation.surrogates"),
    (_rdf_pair, "formulation.phases analysis.rdf_pair"),
]


# ---- runs that follow from the slurry table


def replicas(config: Mapping, slurries: Sequence[Slurry]) -> list[Slurry]:
    """The replicated slurries with other seeds: 6_r1, 6_r2, ... of slurry 6."""
    return [
        dataclasses.replace(
            slurry, id=f"{slurry.id}_r{k}", role="replica", seed=recipe.derived_seed(slurry.seed, f"replica {k}")
        )
        for slurry in slurries
        if slurry.id in config["evaluation"]["replicated"]
        for k in range(1, config["evaluation"]["replicas"] + 1)
    ]


def timestep_runs(config: Mapping, slurries: Sequence[Slurry]) -> list[Slurry]:
    """The slurry of the convergence study with each time step and seed: V1_dt2000ps_s1, ...

    They last as long as the slurry itself and have their frames and thermo rows at the same times.
    """
    study, dem = config["convergence"], config["dem"]
    runs = []
    for slurry in slurries:
        for step_us in study["timesteps_us"] if slurry.id == study["slurry"] else []:
            finer = dem["timestep_us"] / step_us
            settings = {
                "timestep_us": step_us,
                "steps": round(dem["steps"] * finer),
                "thermo_every_steps": round(dem["thermo_every_steps"] * finer),
            }
            runs += [
                dataclasses.replace(
                    slurry,
                    id=f"{slurry.id}_dt{round(step_us * 1e6)}ps_s{k}",
                    role="timestep",
                    seed=recipe.derived_seed(slurry.seed, f"convergence {k}"),
                    dem=settings,
                )
                for k in range(1, study["seeds"] + 1)
            ]
    return runs


def without_training(config: Mapping, label: str) -> bool:
    """Whether a surrogate can be asked in a run that takes a trained model and has no training slurries."""
    surrogate = surrogates.load(surrogates.parse(label).name)
    if surrogate.BOX_RULE == "mean_packing_fraction" and config["surrogate"]["packing_fraction"] is None:
        return False
    return surrogate.MODEL_FILE is None or (
        surrogate.MODEL_FILE == "model.keras" and label in config["surrogate"]["names"]
    )


def first_frame_seen(config: Mapping, label: str) -> int:
    """Earliest last input frame that a surrogate learns from; most learn from the input frames alone."""
    parsed = surrogates.parse(label)
    surrogate, frames = surrogates.load(parsed.name), parsed.input_frames(config["learning"]["input_frames"])
    if not hasattr(surrogate, "first_frame_seen"):
        return max(frames)
    return surrogate.first_frame_seen(frames, config["surrogate"][parsed.name])


def own_relaxation_steps(config: Mapping, label: str) -> int:
    """For how long predictions by the surrogate with this label are relaxed in the main job."""
    settings = config["relaxation"]
    of_surrogate = settings["steps_of"].get(surrogates.parse(label).name, settings["steps"])
    return settings["steps_of"].get(label, of_surrogate)


def dem_settings(config: Mapping, slurry: Slurry) -> dict:
    """The section `dem` as it holds for one run: its own settings, and the damping time for its mass."""
    settings = {**config["dem"], **slurry.dem}
    if exponent := settings.pop("pressure_damping_exponent"):
        settings["pressure_damping_us"] *= slurry.mass_units**exponent
    return settings


# ---- physics of existing results


def physics(config: Mapping, slurry: Slurry) -> dict:
    """All that the DEM of `slurry` depends on, to be stored with its results; survives JSON unchanged.

    Left out: the slurry's role, the density that is only expected, and DEM_NOT_PHYSICS. The order of the phases numbers
    them, so it is listed: a mapping does not keep it.
    """
    formulation = {key: value for key, value in config["formulation"].items() if key != "expected_density_g_cm3"}
    return {
        "formulation": formulation | {"order": list(formulation["phases"])},
        "force_field": config["force_field"],
        "dem": {key: value for key, value in dem_settings(config, slurry).items() if key not in DEM_NOT_PHYSICS},
        "slurry": {key: getattr(slurry, key) for key in ("mass_units", "thickness_ratio", "seed")},
    }


def _settings(value: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """Yield (key path, value) for all that is no mapping and no list of mappings."""
    if isinstance(value, Mapping):
        for key, item in value.items():
            yield from _settings(item, f"{path}.{key}".lstrip("."))
    elif isinstance(value, list) and any(isinstance(item, Mapping) for item in value):
        for index, item in enumerate(value):
            yield from _settings(item, f"{path}[{index}]")
    else:
        yield path, value


def changed_physics(config: Mapping, slurries: Sequence[Slurry], results: str | Path) -> list[str]:
    """Lines that refuse settings other than those with which the DEM results under `results` were computed.

    Reads the key `physics` of `results`/dem/<slurry>/run.json of each slurry that has been run. One line for all
    differences, and one for each file that cannot be read; none where `run.overwrite` is true.
    """
    if config["run"]["overwrite"]:
        return []
    way_out = "choose another run.name, or set run.overwrite: true to compute it anew"
    lines, differences = [], {}
    for slurry in slurries:
        path = Path(results) / "dem" / slurry.id / "run.json"
        if not path.exists():
            continue
        try:
            before = dict(_settings(json.loads(path.read_text(encoding="utf-8"))["physics"]))
        except (OSError, ValueError, KeyError, TypeError):
            lines.append(f"{path}: does not say with which settings it was run: {way_out}")
            continue
        now = dict(_settings(physics(config, slurry)))
        for key in dict.fromkeys([*now, *before]):
            if key not in now or key not in before or now[key] != before[key]:
                was = f"with {key} = {_shown(before[key])}" if key in before else f"without {key}"
                has = _shown(now[key]) if key in now else "none"
                # a setting that all slurries share is one difference
                owner = slurry.id if key.startswith("slurry.") else ""
                line = f"{results}: the DEM of slurry {slurry.id} was run {was}, the configuration has {has}"
                differences.setdefault((owner, key), line)
    if differences:
        first, *others = differences.values()
        more = f" (and {len(others)} more)" if others else ""
        lines.append(f"{first}{more}: {way_out}")
    return lines


# ---- entry points


def _problems(config: Mapping) -> tuple[list[Slurry], list[str]]:
    lines: list[str] = []
    config = _with_text_keys(config, "", lines)
    wrong = dict.fromkeys(_schema_errors(config, schema("config")))
    # "=" between a key and its value, ":" between a key and a word on it
    lines += [f"{path}{': ' if what.startswith(('missing', 'unknown')) else ' = '}{what}" for path, what in wrong]
    bad = [re.split(r"[.\[]", path) for path, _ in wrong]

    def usable(keys: str) -> bool:
        """Whether no wrong key lies on the way to one of `keys` or below it."""
        wanted = [key.split(".") for key in keys.split()]
        return not any(all(a == b for a, b in zip(way, key, strict=False)) for way in bad for key in wanted)

    if ["configuration"] in bad:  # no mapping at all
        return [], lines
    slurries, table_lines = _read_table(config["slurries"]) if usable("slurries") else ([], [])
    lines += table_lines
    if table_lines:
        bad.append(["slurries"])  # the good rows are checked below, but not whether a role is missing
    for check_, keys in _CHECKS:
        if usable(keys):
            lines += check_(config, slurries)
    if usable("run formulation force_field dem evaluation convergence"):
        runs = [*slurries, *replicas(config, slurries), *timestep_runs(config, slurries)]
        lines += changed_physics(config, runs, Path("results") / config["run"]["name"])
    return slurries, [_printable(line) for line in lines]


def check(config: Mapping) -> list[str]:
    """Check a whole configuration, its slurry table, and earlier DEM results under its name in results/.

    Returns a line for each problem (key path or file, value, what is allowed); none means that the workflow may start.
    """
    return _problems(config)[1]


def in_order(config: Mapping, rule: Mapping | None = None) -> dict:
    """The same configuration with its keys in the order of the schema, at every level.

    Laid over another one, the keys of a file come first. Scripts take sections as text, and Snakemake repeats what is
    called with another text. The order of phases, which numbers them, stays.
    """
    rule = schema("config") if rule is None else rule
    known = rule.get("properties", {})
    (further,) = rule.get("patternProperties", {"": {}}).values()
    keys = [key for key in known if key in config] + [key for key in config if key not in known]

    def inside(value: Any, of_value: Mapping) -> Any:
        if isinstance(value, Mapping):
            return in_order(value, of_value)
        return [inside(item, of_value.get("items", {})) for item in value] if isinstance(value, list) else value

    return {key: inside(config[key], known.get(key, further)) for key in keys}


def checked_slurries(config: Mapping) -> list[Slurry]:
    """The slurries of a configuration without problems; raises ConfigurationError with all lines of `check`."""
    slurries, lines = _problems(config)
    if lines:
        raise ConfigurationError(lines)
    return slurries


# ---- config/README.md

GENERATED = "<!-- Below this line: written by PYTHONPATH=scripts python -m slurrycast.config.configuration -->\n"


def _default(value: Any, path: Sequence[str]) -> str:
    """The value at `path` of the shipped configuration; `*` takes all items of a mapping or list."""
    if not path:
        return str(value) if isinstance(value, str) else json.dumps(value)
    key, *rest = path
    if key != "*":
        return _default(value[key], rest)
    items = value.values() if isinstance(value, Mapping) else value
    return ("; " if "*" in rest else ", ").join(_default(item, rest) for item in items) or "none"


def _rows(rule: Mapping, default: Any, name: str = "", path: tuple[str, ...] = ()) -> Iterator[str]:
    """Yield a row of the reference for each key below `rule`."""
    for key, item in rule["properties"].items():
        yield from _row(item, default, f"{name}.{key}".lstrip("."), (*path, key))
    for item in rule.get("patternProperties", {}).values():
        yield from _row(item, default, f"{name}.<{rule['each']}>", (*path, "*"))


def _row(rule: Mapping, default: Any, name: str, path: tuple[str, ...]) -> Iterator[str]:
    if rule["type"] == "object":
        yield from _rows({"properties": {}} | rule, default, name, path)
    elif rule["type"] == "array" and rule["items"]["type"] == "object":
        yield from _rows(rule["items"], default, f"{name}[]", (*path, "*"))
    else:
        shown = _default(default, path) if default is not None else None
        cells = [f"`{name}`", rule.get("unit", ""), rule["description"], allowed(rule)]
        yield "| " + " | ".join(cells + ([f"`{shown}`"] if shown is not None else [])) + " |"


def reference() -> str:
    """The generated part of config/README.md: each key of the configuration and each column of the slurry table."""
    default = yaml.safe_load((ROOT / "config" / "config.yaml").read_text(encoding="utf-8"))
    text = "\n## Keys\n\nEvery key is required. The last column is `config.yaml`, the demo scale.\n"
    head = "| key | unit | meaning | allowed | demo |\n|---|---|---|---|---|\n"
    for key, rule in schema("config")["properties"].items():
        text += f"\n### `{key}`\n\n" + (f"{rule['description']}\n\n" if rule["type"] == "object" else "")
        text += head + "\n".join(_row(rule, default, key, (key,))) + "\n"
    text += "\n## Columns of the slurry table\n\n| column | unit | meaning | allowed |\n|---|---|---|---|\n"
    return text + "\n".join(_rows(schema("slurries"), None)) + "\n"


def main() -> None:
    """Write the generated part of config/README.md anew."""
    path = ROOT / "config" / "README.md"
    written_by_hand, marker, _ = path.read_text(encoding="utf-8").partition(GENERATED)
    path.write_text(written_by_hand + (marker or GENERATED) + reference(), encoding="utf-8")


if __name__ == "__main__":
    main()
