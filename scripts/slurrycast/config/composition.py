"""The recipe of the slurry, with solvent, from that of a dry tape: tape casters state either.

The other modules know wet compositions alone, so that this is done once, before the configuration is used.
"""

from collections.abc import Mapping


def wet_composition(config: Mapping) -> dict:
    """The same configuration, with all mass fractions those of the slurry and the solvent a share of its phase.

    Of the mass fractions of a dry composition, that of the phase of the solvent grows by the solvent, and all are
    scaled to the sum that they had. With d the share of the phase in the dry tape, and s that of the solvent in the
    slurry, the share of the solvent in its phase is s / (d (1 - s) + s). In a wet composition with share f of the phase
    it is s / f: 1 or more where `drying_checks.solvent` finds too much of it.

    Parameters
    ----------
    config
        The configuration, whose sections formulation and drying are right but for sums of fractions.
    """
    drying, phases = config["drying"], config["formulation"]["phases"]
    dry = drying["composition_is"] == "dry"
    if drying["phase"] not in phases or not (dry or drying["solvent_fraction_of"] == "slurry"):
        return dict(config)
    fractions = {name: phase["mass_fraction"] for name, phase in phases.items()}
    total, of_phase, solvent = sum(fractions.values()), fractions[drying["phase"]], drying["solvent_mass_fraction"]
    if drying["solvent_fraction_of"] == "slurry":
        solvent = solvent / (of_phase / total * (1 - solvent) + solvent if dry else of_phase / total)
    if dry:
        fractions[drying["phase"]] = of_phase / (1 - solvent)
        fractions = {name: fraction * total / sum(fractions.values()) for name, fraction in fractions.items()}
    wet = {name: phase | {"mass_fraction": fractions[name]} for name, phase in phases.items()}
    as_wet = {"composition_is": "wet", "solvent_fraction_of": "phase", "solvent_mass_fraction": solvent}
    return {**config, "formulation": config["formulation"] | {"phases": wet}, "drying": drying | as_wet}
