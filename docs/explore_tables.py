"""Tables of docs/explore.md: each public function gives one."""

import pandas as pd

from reference_results import read_result
from slurrycast.report.names import input_name, tape_quantity


def explored() -> pd.DataFrame:
    """Each property: mean and scatter, the inputs that matter most, and how far the fit holds."""
    models, noise = (read_result("explore", f"explore_{name}").set_index("property") for name in ("models", "noise"))
    indices = read_result("explore", "explore_indices")
    rows = []
    for name, model in models.iterrows():
        of_property = indices[indices.property == name].nlargest(2, "total")
        matters = [f"{input_name(row.input)} ({row.total:.2f})" for row in of_property.itertuples()]
        rows.append(
            {
                "property": tape_quantity(name, noise.unit[name]),
                "mean": f"{noise['mean'][name]:.4g}",
                "sd of recipes": f"{noise.sd[name]:.2g}",
                "replica sd": f"{noise.replica_sd[name]:.2g}",
                "matters most (total index)": ", ".join(matters),
                "error / replica sd": f"{model.loo_over_replica_sd:.1f}",
                "coverage of 90%": f"{model.coverage_90_calibrated:.0%}",
            }
        )
    return pd.DataFrame(rows)
