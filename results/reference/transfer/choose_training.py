"""Choose epochs and learning rate of further trainings on the validation recipe of config/transfer.yaml.

    .venv/bin/python results/reference/transfer/choose_training.py results/transfer choices.csv

Each network is trained on one validation slurry and predicts the other, from its model in the run of
config/transfer.yaml and from scratch. Takes some 20 CPU minutes.
Out: CSV of surrogate, start, epochs, learning_rate, skill, and the CPU seconds of training and prediction.
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import pandas as pd
import yaml

ROOT = Path(__file__).resolve().parents[3]
SCRIPT = ROOT / "scripts" / "transfer" / "tune_surrogate.py"
TRAINED_ON, PREDICTED = "V1", "V2"
TRIED = [  # surrogate, start, epochs, learning_rate
    *[("vgg16", "fine_tuned", *setting) for setting in ((12, 1e-5), (12, 5e-5), (12, 1e-4), (48, 1e-5), (48, 1e-4))],
    *[("vgg16", "from_scratch", epochs, 1e-4) for epochs in (24, 96)],
    *[
        ("neighbours", "fine_tuned", *setting)
        for setting in ((10, 1.5e-3), (10, 5e-3), (10, 1.5e-2), (30, 1.5e-3), (30, 5e-3))
    ],
    *[("neighbours", "from_scratch", epochs, 1.5e-2) for epochs in (66, 150)],
]


def main() -> None:
    """Train all, and write the table after each."""
    results, table = map(Path, sys.argv[1:])
    config = yaml.safe_load((results / "config.yaml").read_text(encoding="utf-8"))
    trained_on, predicted = (results / "frames" / f"{slurry}.h5" for slurry in (TRAINED_ON, PREDICTED))
    phases = list(config["formulation"]["phases"])
    rows = []
    for surrogate, start, epochs, rate in TRIED:
        settings = config["surrogate"][surrogate] | {"epochs": epochs, "learning_rate": rate}
        settings.pop("start_from")
        with tempfile.TemporaryDirectory() as folder:
            command = [sys.executable, SCRIPT, "--surrogate", surrogate, "--settings", json.dumps(settings)]
            command += ["--seed", config["learning"]["seed"], "--frames", trained_on, "--predicted", predicted]
            command += ["--input-frames", 7, 8, 9, 10, "--target-frame", 120, "--phases", *phases]
            command += ["--validation-share", config["learning"]["validation_share"]]
            command += ["--packing", results / "dataset" / "packing_fraction_less_bdpd.json"]
            command += ["--noise", results / "tables" / "noise.csv", "--work", Path(folder) / "work"]
            command += ["--table", Path(folder) / "table.csv", "--cost", Path(folder) / "cost.json"]
            command += ["--start-from", results / "models" / surrogate / "model.keras"] * (start == "fine_tuned")
            subprocess.run([str(word) for word in command], cwd=ROOT, check=True)
            (row,) = pd.read_csv(Path(folder) / "table.csv").to_dict("records")
            cpu_s = json.loads((Path(folder) / "cost.json").read_text(encoding="utf-8"))["cpu_s"]
        keys = {"surrogate": surrogate, "start": start, "epochs": epochs, "learning_rate": rate}
        rows.append(keys | {"skill": row["skill"], "cpu_s": cpu_s})
        pd.DataFrame(rows).to_csv(table, index=False, float_format="%.6g")


if __name__ == "__main__":
    main()
