"""Compare `direct` with the DEM where its recipe is far from the one that the relaxation was chosen for.

    cd results/reference/direct_limits
    for name in recipe attraction_10 attraction_100 friction; do
        snakemake -s ../../../Snakefile --directory ../../.. --cores 2 slurries microstructures --configfile $name.yaml
        snakemake -s ../../../Snakefile --directory ../../.. --cores 2 microstructures \
            --config "run={name: limits_${name}_dense}" --configfile $name.yaml dense.yaml
    done
    python measure_limits.py limits.csv

Out: CSV of recipe, source (dem; direct; direct, dense: from a packing fraction of 0.6), slurry, and what was measured
at the end. The four slurries differ in their seeds alone.
"""

import sys
from pathlib import Path

import pandas as pd

ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "scripts"))
from slurrycast.analysis.structure import structure_measures  # noqa: E402
from slurrycast.data.frames import read_frames  # noqa: E402

RECIPES = ("recipe", "attraction_10", "attraction_100", "friction")
MEASURES = ("density_g_cm3", "coordination_all", "share_below_4_contacts", "overlap_mean")
SLURRIES = ("V1", "V2", "V3", "V4")


def main() -> None:
    """Measure all and write the table."""
    rows = []
    for recipe in RECIPES:
        results = ROOT / "results" / f"limits_{recipe}"
        for slurry in SLURRIES:
            ends = {"dem": results / "frames" / f"{slurry}.h5"}
            for source, name in {"direct": recipe, "direct, dense": f"{recipe}_dense"}.items():
                hybrid = ROOT / "results" / f"limits_{name}" / "hybrid"
                ends[source] = hybrid / "direct" / slurry / "relaxed.h5"
            for source, path in ends.items():
                with read_frames(path) as store:
                    frame = store.last
                    measures = structure_measures(store.position_um(frame), *store.box(frame), store.particles)
                names = {"recipe": recipe, "source": source, "slurry": slurry, "particles": len(store.particles)}
                rows.append(names | {name: measures[name] for name in MEASURES})
    pd.DataFrame(rows).to_csv(sys.argv[1], index=False, float_format="%.6g")


if __name__ == "__main__":
    main()
