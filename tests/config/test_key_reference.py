"""The schemas, and config/README.md, which is written from them."""

import jsonschema
import pytest

from configurations import ROOT, shipped
from slurrycast.config import reference
from slurrycast.config.schema_errors import schema
from slurrycast.dem.recipe import particle_counts, particle_types

README = (ROOT / "config" / "README.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("name", ["config", "slurries"])
def test_schemas_are_valid_and_refuse_unknown_keys_at_every_level(name):
    def sections(rule):
        if rule.get("type") == "object":
            yield rule
        items = [rule["items"]] if "items" in rule else []
        for item in [*rule.get("properties", {}).values(), *rule.get("patternProperties", {}).values(), *items]:
            assert "type" in item and "description" in item
            yield from sections(item)

    jsonschema.Draft202012Validator.check_schema(schema(name))
    recipes = list(sections(schema("config")["properties"]["formulations"]))  # hold what differs
    for section in sections(schema(name)):
        assert section["additionalProperties"] is False
        needed = [key for key in section.get("properties", {}) if (name, key) != ("slurries", "formulation")]
        optional = section in recipes or "minProperties" in section
        assert optional or section.get("required", []) == needed


def test_readme_is_in_step_with_schema_and_configuration():
    assert README.partition(reference.GENERATED)[2] == reference.reference(), reference.GENERATED


@pytest.mark.parametrize("path", sorted((ROOT / "config").glob("*.yaml")), ids=lambda path: path.stem)
def test_readme_has_every_configuration_with_its_scale(path):
    """In its table, between the name of the file and what it is for."""
    rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in README.splitlines() if line.startswith("| `")]
    named = [row for row in rows if f"`{path.name}`" in row[0]]
    assert len(named) == 1, f"config/README.md needs one row for {path.name} in the table of scales"
    row = named[0]
    config = shipped(path.stem)
    types = particle_types(config["formulation"]["phases"])
    particles = particle_counts(types, config["formulation"]["unit_mass_pg"]).sum()
    networks = [network for network in ("vgg16", "neighbours") if network in config["surrogate"]["names"]]
    epochs = {network: config["surrogate"][network]["epochs"] for network in networks}
    assert row[1:5] == [
        f"{particles:,}".replace(",", " "),
        f"{config['dem']['steps']:,}".replace(",", " ") if networks else "none",
        f"{config['dem']['timestep_us']:.0e}".replace("e-0", "e-"),
        ", ".join(f"{n}" if network == "vgg16" else f"{n} of `{network}`" for network, n in epochs.items()) or "none",
    ]
