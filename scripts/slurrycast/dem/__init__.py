"""The discrete element method: recipe, force field, and everything that talks to LAMMPS."""
