"""The configuration and the slurry table of a run: what they may hold, and what follows from them.

configuration       entry: checks everything before any job, and reports all problems at once
schema_errors       what the schemas in workflow/schemas allow, and the lines that say so
slurry_table        reads the slurry table
formulations        the recipes of one run, and the configuration as it holds for a slurry
dem_checks          checks across keys: recipe, force field, DEM, frames, studies
surrogate_checks    checks across keys: surrogates, their labels and models
label_settings      what the configuration means for one label of a surrogate
derived_runs        replicas and time step runs, which follow from rows of the slurry table
physics             what the DEM results of a slurry depend on, and whether it has changed since they were computed
reference           writes the reference of all keys in config/README.md
"""
