"""Tables of docs/tape.md: each public function gives one."""

import pandas as pd

from reference_results import MISSING, drying_changes, load

FORMS = {
    "green density (g/cm³)": ("green_density_g_cm3", 1, 3),
    "void (points)": ("void", 100, 2),
    "ceramic share (points)": ("ceramic_share", 100, 2),
    "contacts": ("coordination", 1, 2),
}


def drying_settings() -> pd.DataFrame:
    """What the settings of the drying change, and the tapes of the shipped ones; ± is one standard error."""
    rows = drying_changes()
    drying = load("config")["drying"]
    defaults = drying | drying["force_field"]
    shown = []
    for (particles, setting, value), row in rows.iterrows():
        shipped = setting == "none"
        sign = "" if shipped else "+"
        cells = {"setting": "as configured" if shipped else setting}
        cells["value"] = MISSING if shipped else f"{value:g}, not {defaults[setting]:g}"
        cells["particles"] = f"{particles:,}"
        for name, (measure, factor, places) in FORMS.items():
            mean, error = factor * row[measure, "mean"], factor * row[measure, "sem"]
            cells[name] = f"{mean:{sign}.{places}f} ± {error:.{places}f}"
        shown.append(cells)
    return pd.DataFrame(shown)
