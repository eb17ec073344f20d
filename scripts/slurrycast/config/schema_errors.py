"""The schemas in workflow/schemas, and a line for each value that breaks one: its key, the value and what is allowed.

`unit`, `allowed`, `each`, `whole` and `formerly` in the schemas are annotations that JSON Schema ignores.
"""

import decimal
import difflib
import functools
import json
import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import jsonschema
import yaml

ROOT = Path(__file__).resolve().parents[3]
KINDS = {"integer": "a whole number", "number": "a number", "boolean": "true or false", "string": "text"}
BOUNDS = {"exclusiveMinimum": "above", "minimum": "at least", "exclusiveMaximum": "below", "maximum": "at most"}


def _is_whole(_, value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def _is_finite(_, value: Any) -> bool:
    return _is_whole(_, value) or (isinstance(value, float) and math.isfinite(value))


# JSON Schema takes 2.0 for an integer, and Python takes NaN for a number.
_TYPES = jsonschema.Draft202012Validator.TYPE_CHECKER.redefine_many({"integer": _is_whole, "number": _is_finite})
_Validator = jsonschema.validators.extend(jsonschema.Draft202012Validator, type_checker=_TYPES)


@functools.cache
def schema(name: str) -> dict:
    """The schema in workflow/schemas/`name`.schema.yaml."""
    return yaml.safe_load((ROOT / "workflow" / "schemas" / f"{name}.schema.yaml").read_text(encoding="utf-8"))


def allowed(rule: Mapping) -> str:
    """Describe what the schema `rule` allows."""
    if "allowed" in rule:
        return rule["allowed"]
    if "enum" in rule:
        return "one of " + ", ".join(rule["enum"])
    if rule["type"] == "object":
        return "a section with " + ", ".join(rule["properties"])
    limits = " and ".join(f"{name} {rule[bound]:.12g}" for bound, name in BOUNDS.items() if bound in rule)
    return f"{KINDS[rule['type']]} {limits}".rstrip()


def shown(value: Any) -> str:
    """A value as it is written in YAML or JSON, shortened to fit on a line."""
    text = json.dumps(value, default=str, ensure_ascii=False)
    return text if len(text) <= 60 else f"{text[:57]}..."


def down(value: float, digits: int = 4) -> str:
    """A number as an upper bound in a message, rounded so that what is shown is allowed."""
    return _rounded(value, digits, decimal.ROUND_FLOOR)


def up(value: float, digits: int = 4) -> str:
    """The same of a lower bound."""
    return _rounded(value, digits, decimal.ROUND_CEILING)


def _rounded(value: float, digits: int, rounding: str) -> str:
    exact = decimal.Decimal(f"{value:.12g}")  # 3.6 of 3.6000000000000005
    return f"{float(decimal.Context(prec=digits, rounding=rounding).create_decimal(exact)):.{digits}g}"


def _hint(value: Any, rule: Mapping) -> str:
    """What to write instead, where YAML reads something else than the user meant."""
    kind = rule.get("type")
    if kind == "string" and value is not None and not isinstance(value, str | list | Mapping):
        return " (put it in quotes to make it text)"
    if kind not in ("number", "integer") or not isinstance(value, str) or len(value) > 30:
        return ""
    number = re.fullmatch(r"([-+]?\d+)(\.\d*)?(?:[eE]([-+]?)(\d{1,3}))?", value.strip(), re.ASCII)
    if not number or (kind == "integer" and not float(value).is_integer()):
        return ""
    whole, fraction, sign, power = number.groups()
    if power is None:
        return f" (it is text: write {value.strip()} without quotes)"
    # YAML 1.1 wants both a point and a sign of the exponent
    point = fraction if fraction and fraction != "." else ".0"
    as_yaml = f"{float(value):.0f}" if kind == "integer" else f"{whole}{point}e{sign or '+'}{power}"
    return f" ({value.strip()} is text in YAML: write {as_yaml})"


def with_text_keys(value: Any, path: str, lines: list[str]) -> Any:
    """Copy `value` with all keys as text, and add a line for each key that is not: YAML reads `no:` as false.

    Parameters
    ----------
    value : mapping, list or scalar
        A configuration or a part of one.
    path : str
        Key path of `value`; empty for a whole configuration.
    lines : list of str
        The lines are added here.

    Returns
    -------
    Any
        The copy of `value`.
    """
    if isinstance(value, Mapping):
        wrong = [shown(key) for key in value if not isinstance(key, str)]
        lines += [f"{path or 'configuration'}: key {key} is not text: put it in quotes" for key in wrong]
        return {str(k): with_text_keys(v, f"{path}.{k}".lstrip("."), lines) for k, v in value.items()}
    if isinstance(value, list):
        return [with_text_keys(item, f"{path}[{i}]", lines) for i, item in enumerate(value)]
    return value


def _key_path(parts: Sequence[str | int]) -> str:
    """`a.b[0].c` for the parts a, b, 0, c."""
    return "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in parts).lstrip(".")


def schema_errors(value: Any, rule: Mapping, hint: Callable[[Any, Mapping], str] = _hint) -> Iterator[tuple[str, str]]:
    """Yield (key path, what is wrong) for each way in which `value` breaks the schema `rule`.

    Parameters
    ----------
    value : mapping
        A configuration or a row of the slurry table.
    rule : mapping
        The schema.
    hint : callable
        Gives the end of a line, for the wrong value and its schema.
    """
    for error in _Validator(rule).iter_errors(value):
        path, local_rule, wrong = list(error.absolute_path), error.schema, error.instance
        if error.validator == "required":
            for key in (key for key in local_rule["required"] if key not in wrong):
                why = f" ({local_rule['whole']})" if "whole" in local_rule else ""
                yield _key_path([*path, key]), f"missing: must be {allowed(local_rule['properties'][key])}{why}"
        elif error.validator == "additionalProperties":
            known, patterns = list(local_rule.get("properties", {})), local_rule.get("patternProperties", {})
            may_be = f"one of {', '.join(known)}" if known else local_rule.get("allowed")
            for key in wrong:
                if key in local_rule.get("formerly", {}):
                    yield _key_path([*path, key]), f"unknown key: {local_rule['formerly'][key]}"
                elif key not in known and not any(re.search(pattern, key) for pattern in patterns):
                    close = difflib.get_close_matches(key, known, 1)
                    guess = f" (do you mean {close[0]}?)" if close else ""
                    yield _key_path([*path, key]), f"unknown key: must be {may_be}{guess}"
        else:
            place = _key_path(path) or "configuration"
            yield place, f"{shown(wrong)}: must be {allowed(local_rule)}{hint(wrong, local_rule)}"
