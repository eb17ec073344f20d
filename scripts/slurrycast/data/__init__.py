"""Data that are stored and read: frames, trajectories, training sets, tables, periodic boxes."""
