"""Compare slurry 2 at the published size, with the time step and the barostat of Table 1 and with larger steps.

    snakemake --cores 2 evaluation --configfile config/published.yaml
    snakemake --cores 2 results/npt/frames/2{,_r1,_r2}.h5 \
        --configfile config/published_dt1e-4.yaml results/reference/timestep/npt.yaml
    snakemake --cores 1 results/table_1/frames/2.h5 \
        --configfile config/published_dt1e-4.yaml results/reference/timestep/table_1.yaml
    PATH=.venv/bin:$PATH python results/reference/timestep/compare_published.py \
        results/reference/timestep/published.csv results/npt/2{,_r1,_r2} results/published/2{,_r1,_r2,_r3} \
        results/table_1/2

In: for each row the folder of a run, followed by a slurry of it.
Out: CSV of one row a slurry: barostat, time step, seed, time that was simulated, the last density and contacts, the
RDF's mean difference from those of the other seeds of the first run, time to equilibrium, CPU hours of LAMMPS, and
milliseconds a step in its last segment.
"""

import json
import sys
from pathlib import Path

import numpy as np
import pandas as pd

ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "scripts"))
from slurrycast.analysis.rdf import bin_edges_um, mean_absolute_difference, radial_distributions  # noqa: E402
from slurrycast.analysis.structure import structure_measures  # noqa: E402
from slurrycast.data.frames import read_frames  # noqa: E402
from slurrycast.dem.equilibrium import equilibrium  # noqa: E402

CUTOFF_UM, BINS = 7.0, 120
MEASURES = ("density_g_cm3", "coordination_all", "share_below_4_contacts", "overlap_mean")


def measured(run: Path, slurry: str) -> tuple[dict, np.ndarray]:
    """The row of one slurry but for the RDF, and g(r) (bins,) of all particles."""
    store = read_frames(run / "frames" / f"{slurry}.h5")
    done = json.loads((run / "dem" / slurry / "run.json").read_text(encoding="utf-8"))
    thermo = pd.read_csv(run / "dem" / slurry / "thermo.csv")
    position_um, (lower_um, edges_um) = store.position_um(store.last), store.box(store.last)
    structure = structure_measures(position_um, lower_um, edges_um, store.particles)
    bins_um = bin_edges_um(CUTOFF_UM, BINS, [edges_um])
    dem, last = done["physics"]["dem"], done["segments"][-1]
    row = {
        "run": run.name,
        "slurry": slurry,
        "barostat": dem["barostat"],
        "timestep_us": dem["timestep_us"],
        "seed": done["physics"]["slurry"]["seed"],
        "simulated_us": thermo.time_us.iloc[-1],
        **{name: structure[name] for name in MEASURES},
        "time_to_equilibrium_us": equilibrium(
            thermo.time_us.to_numpy(), thermo.density_g_cm3.to_numpy()
        ).time_to_equilibrium_us,
        "cpu_h": (done["start"]["cpu_s"] + sum(segment["cpu_s"] for segment in done["segments"])) / 3600,
        "last_cpu_ms_per_step": 1000 * last["cpu_s"] / (last["step_end"] - last["step_start"]),
    }
    return row, radial_distributions(position_um, lower_um, edges_um, store.particles, bins_um)["all"]


def main() -> None:
    """Measure all and write the table."""
    rows, curves = zip(*(measured(Path(path).parent, Path(path).name) for path in sys.argv[2:]), strict=True)
    table = pd.DataFrame(rows)
    for i, seed in table.seed.items():
        others = table.index[(table.run == table.run[0]) & (table.seed != seed)]
        differences = [mean_absolute_difference(curves[i], curves[other]) for other in others]
        table.loc[i, "rdf_difference"] = np.mean(differences)
    table.to_csv(sys.argv[1], index=False, float_format="%.6g")


if __name__ == "__main__":
    main()
