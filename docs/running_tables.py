"""Tables of docs/cluster.md, docs/reliability.md and results/reference/README.md: each public function gives one."""

import json

import pandas as pd

from reference_results import MISSING, REFERENCE, measured_rates, published_estimates


def rates() -> pd.DataFrame:
    """Rates of the reference run of the published size."""
    measured = measured_rates()
    cpu_s = pd.read_csv(REFERENCE / "timestep" / "timestep_summary.csv").set_index("timestep_us").cpu_s_mean
    fine = cpu_s[1e-4] * 1e-4 / (cpu_s[2e-3] * 2e-3)
    rows = [
        ("DEM, million particle-steps in a CPU second", f"{measured['dem'] / 1e6:.1f}"),
        ("CPU time of a DEM step of 1e-4 µs over that of a step of 2e-3 µs", f"{fine:.2f}"),
        ("relaxation, million particle-steps in a CPU second", f"{measured['relaxation'] / 1e6:.1f}"),
        ("training of `vgg16`, CPU time for a particle and epoch (ms)", f"{1e3 * measured['training_s']:.2f}"),
        ("memory of the largest DEM process (MB)", f"{measured['memory_mb']:.0f}"),
    ]
    return pd.DataFrame(rows, columns=["quantity", "measured"])


def published_scale() -> pd.DataFrame:
    """Estimated CPU hours of the two configurations of the published size."""
    names = ("published", "published_dt1e-4")
    table = published_estimates(names[0])[["job", "particles"]]
    table["particles"] = table.particles.map("{:,}".format)
    for name in names:
        estimates = published_estimates(name)
        table[f"`{name}`: steps or epochs"] = estimates.steps.map("{:,}".format)
        table[f"`{name}`: CPU hours"] = estimates.cpu_h.map(lambda hours: f"{hours:.{1 if hours >= 1 else 2}f}")
    return table


def mpi_ranks() -> pd.DataFrame:
    """Two slurries side by side on one rank each, or one after the other on two ranks: wall seconds, medians."""
    times = pd.read_csv(REFERENCE / "mpi" / "ranks.csv").groupby("particles").median()
    columns = {
        "side by side, one rank each (s)": times.side_by_side_s,
        "one after the other, two ranks (s)": 2 * times.two_ranks_s,
        "ratio": 2 * times.two_ranks_s / times.side_by_side_s,
    }
    text = pd.DataFrame(columns).map("{:.2f}".format)
    return text.set_axis(text.index.map("{:,}".format)).rename_axis("particles of each").reset_index()


def faults() -> pd.DataFrame:
    """Injected faults by kind."""
    lost = pd.read_csv(REFERENCE / "torture" / "campaign.csv").groupby("kind", sort=False).lost
    counts = pd.DataFrame({"injected": lost.size(), "survived": lost.size() - lost.count(), "lost": lost.count()})
    return counts.rename_axis("fault").reset_index().astype(str)


def runs() -> pd.DataFrame:
    """Commit and machine of each reference run that has them, and the epochs of its networks."""
    rows = []
    for path in sorted(REFERENCE.glob("*/versions.json")):
        versions = json.loads(path.read_text(encoding="utf-8"))
        epochs = {file.parent.name: len(pd.read_csv(file)) for file in sorted(path.parent.glob("models/*/history.csv"))}
        shown = ", ".join(f"`{network}` {number}" for network, number in epochs.items()) or MISSING
        rows.append((f"`{path.parent.name}/`", f"`{versions['workflow_commit'][:7]}`", versions["machine"], shown))
    return pd.DataFrame(rows, columns=["folder", "commit", "machine", "epochs"])
