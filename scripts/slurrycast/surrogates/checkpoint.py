"""The epochs of a training: where it stands is on disk after each, and the learning curves at its end."""

import hashlib
import json
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from slurrycast.runtime.costs import spent_so_far
from slurrycast.runtime.files import InputError, RunError, check_unchanged, hdf5_moved_into_place, write_text

if TYPE_CHECKING:
    import tensorflow as tf


@dataclass
class Progress:
    """Where a training stands, beside weights and optimizer."""

    history: list[np.ndarray] = field(default_factory=list)  # loss, mae, val_loss, val_mae and more of each epoch
    best: list[np.ndarray] = field(default_factory=list)  # weights of the epoch with the lowest val_loss
    earlier: dict[str, float] = field(default_factory=lambda: {"wall_s": 0.0, "cpu_s": 0.0})  # cost of other attempts


def fingerprint(arrays: Iterable[np.ndarray], settings: Mapping) -> str:
    """Digest that tells a data set with settings from others."""
    digest = hashlib.sha256(json.dumps(dict(settings), sort_keys=True).encode())
    for array in arrays:
        digest.update(np.ascontiguousarray(array))
    return digest.hexdigest()


def without_epochs(settings: Mapping) -> dict:
    """What makes each epoch of a training what it is, where their number does not."""
    return {key: value for key, value in settings.items() if key != "epochs"}


def run_epochs(
    name: str,
    settings: Mapping,
    checkpoint: Path,
    identity: str,
    variables: Mapping[str, Sequence["tf.Variable"]],
    train_epoch: Callable[[int], np.ndarray],
    *,
    earlier: Mapping[str, float] | None = None,
    validated: bool = True,
    keep_best: bool = False,
) -> Progress:
    """Run the epochs, or those after a checkpoint, and write a checkpoint after each.

    Parameters
    ----------
    name
        Name of the surrogate for messages, with the number of the member if there are several.
    settings
        epochs, learning_rate; patience and min_improvement, if the training may end earlier (`has_settled`).
    checkpoint, identity
        File, and the `fingerprint` that it must have.
    variables
        "weights" and state of the optimizer, which a checkpoint keeps.
    train_epoch
        Trains the epoch of this number, and returns loss, mae, val_loss, val_mae and what else the history holds.
    earlier
        Cost before this training.
    validated
        Whether val_loss and val_mae are numbers.
    keep_best
        Whether the weights of the epoch with the lowest val_loss are kept.

    Raises
    ------
    RunError
        If the loss is not finite.
    """
    progress = Progress(earlier=dict(earlier or {"wall_s": 0.0, "cpu_s": 0.0}))
    stored = read_checkpoint(checkpoint, identity, name)
    if stored and len(stored[1].history) > settings["epochs"]:
        print(f"[{name}] {checkpoint} is of more epochs: starting anew", flush=True)
    elif stored:
        state, progress = stored
        assign(variables, state)
        print(f"[{name}] resuming after epoch {len(progress.history)}", flush=True)
    epochs, first, start = settings["epochs"], len(progress.history), time.monotonic()
    for epoch in range(first + 1, epochs + 1):
        if has_settled([losses[2] for losses in progress.history], settings):
            print(f"[{name}] stopped after epoch {epoch - 1}: val_loss has settled", flush=True)
            break
        row = train_epoch(epoch)
        if not np.isfinite(row[: 4 if validated else 2]).all():
            raise RunError(
                f"{name.partition(' ')[0]}: the loss is not finite in epoch {epoch}, "
                f"learning_rate {settings['learning_rate']} is too large"
            )
        if keep_best and row[2] < min((losses[2] for losses in progress.history), default=np.inf):
            progress.best = [weight.numpy() for weight in variables["weights"]]
        progress.history.append(row)
        left_s = (time.monotonic() - start) / (epoch - first) * (epochs - epoch)
        losses = f"loss {row[0]:.4g} val_loss {row[2]:.4g}"
        print(f"[{name}] epoch {epoch}/{epochs} {losses}, {left_s:.0f} s left", flush=True)
        state = {key: [variable.numpy() for variable in group] for key, group in variables.items()}
        write_checkpoint(checkpoint, identity, state, progress)
    return progress


def has_settled(val_losses: Sequence[float], settings: Mapping) -> bool:
    """Whether the lowest loss fell by no more than the share `min_improvement` in the last `patience` epochs."""
    patience = settings.get("patience")
    if patience is None or len(val_losses) <= patience:
        return False
    return min(val_losses) >= (1 - settings["min_improvement"]) * min(val_losses[:-patience])


def assign(variables: Mapping[str, Sequence["tf.Variable"]], state: Mapping[str, Sequence[np.ndarray]]) -> None:
    """Give all variables the values of a state."""
    for key, group in variables.items():
        for variable, value in zip(group, state[key], strict=True):
            variable.assign(value)


def write_checkpoint(path: Path, identity: str, state: Mapping[str, list[np.ndarray]], progress: Progress) -> None:
    """Write the arrays of `state` (weights, optimizer) and the progress, with the cost of all attempts so far."""
    with hdf5_moved_into_place(path) as file:
        file.attrs["fingerprint"] = identity
        for clock, seconds in spent_so_far().items():
            file.attrs[clock] = progress.earlier[clock] + seconds
        file["history"] = np.array(progress.history)
        for name, arrays in {**state, "best": progress.best}.items():
            group = file.create_group(name)
            for place, array in enumerate(arrays):
                group[str(place)] = array


def read_checkpoint(path: Path, identity: str, name: str) -> tuple[dict[str, list[np.ndarray]], Progress] | None:
    """Return state and progress as written; None, and a printed line that says why, if they are of no use."""
    import h5py

    if not path.exists():
        return None
    try:
        check_unchanged(path)
        with h5py.File(path) as file:
            if file.attrs["fingerprint"] != identity:
                print(f"[{name}] {path} is of other settings or another data set: starting anew", flush=True)
                return None
            groups = [key for key in file if key != "history"]
            state = {key: [file[f"{key}/{place}"][()] for place in range(len(file[key]))] for key in groups}
            progress = Progress(
                history=list(file["history"][:]),
                best=state.pop("best"),
                earlier={clock: float(file.attrs[clock]) for clock in ("wall_s", "cpu_s")},
            )
    except (OSError, KeyError, InputError) as error:
        print(f"[{name}] {path} cannot be read ({error}): starting anew", flush=True)
        return None
    return state, progress


def write_history(path: str | Path, losses: Iterable[np.ndarray], held_out: Iterable[str] = ()) -> None:
    """Write learning curves (CSV) from the losses of each epoch; NaN is left empty.

    They are loss, mae, val_loss and val_mae, then loss and mae of each set of `held_out` slurries.
    """
    names = ["epoch", "loss", "mae", "val_loss", "val_mae"]
    names += [f"{name}_slurries_{measure}" for name in held_out for measure in ("loss", "mae")]
    rows = (
        ",".join([str(epoch), *("" if np.isnan(value) else repr(float(value)) for value in row)])
        for epoch, row in enumerate(losses, start=1)
    )
    write_text(path, "\n".join([",".join(names), *rows, ""]))
