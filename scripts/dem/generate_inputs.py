"""Write the LAMMPS inputs of one slurry: random particles in a box centred at the origin, and their pair coefficients.

In: the physics of the slurry as JSON: sections formulation, force_field and dem of the configuration, and the slurry's
row (mass in units, thickness ratio Lz/Lx, seed).
Out: a LAMMPS data file (um, g/cm3), pair coefficients of the forces and of the push-off, and a JSON file that says what
was reached: particles per type, mass fractions, derived seeds. Everything follows from the slurry's seed.
"""

import json
from dataclasses import asdict

from slurrycast.dem import recipe
from slurrycast.dem.forcefield import coefficients, push_off_coefficients
from slurrycast.dem.lammps_data import write_data
from slurrycast.runtime.command_line import Namespace, Parser, run_main
from slurrycast.runtime.costs import measured_cost
from slurrycast.runtime.files import write_text


def add_options(parser: Parser) -> None:
    """Add the options."""
    parser.add_value("--slurry", "id of the slurry")
    parser.add_value("--physics", "JSON as described above", type=json.loads)
    parser.add_output("--data", "LAMMPS data file")
    parser.add_output("--coefficients", "pair_coeff lines of the real forces")
    parser.add_output("--push-off", "pair_coeff lines of the soft push-off")
    parser.add_output("--inputs", "JSON with counts, fractions reached and seeds")
    parser.add_output("--cost", "cost record, JSON")


def main(args: Namespace) -> None:
    """Write the inputs."""
    formulation, row = args.physics["formulation"], args.physics["slurry"]
    with measured_cost(args.cost, "generate_inputs", slurry=args.slurry) as cost:
        types = recipe.particle_types(formulation["phases"])
        counts = recipe.particle_counts(types, row["mass_units"] * formulation["unit_mass_pg"])
        cost.particles = int(counts.sum())
        seeds = {
            purpose: recipe.derived_seed(row["seed"], purpose) for purpose in ("positions", "velocities", "relaxation")
        }
        write_text(args.coefficients, coefficients(types, args.physics["force_field"]))
        write_text(args.push_off, push_off_coefficients(types))
        reached = recipe.mass_fractions(types, counts)
        report = {
            "slurry": args.slurry,
            "physics": args.physics,
            "seeds": seeds,
            "particles": cost.particles,
            "mass_pg": float(counts @ [t.mass_pg for t in types]),
            "mass_fractions_reached": reached,
            "types": [{**asdict(t), "particles": int(n)} for t, n in zip(types, counts, strict=True)],
        }
        type, position_um, edges_um = recipe.random_start(report, "positions")
        write_data(args.data, f"slurry {args.slurry}", types, type, position_um, -edges_um / 2, edges_um)
        write_text(args.inputs, json.dumps(report, indent=1) + "\n")
    wanted = {phase: settings["mass_fraction"] for phase, settings in formulation["phases"].items()}
    fractions = ", ".join(f"{phase} {share:.4f} (wanted {wanted[phase]:.4f})" for phase, share in reached.items())
    print(f"[{args.slurry}] {cost.particles} particles; mass fractions {fractions}")


if __name__ == "__main__":
    run_main(main, add_options, __doc__)
