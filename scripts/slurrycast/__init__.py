"""What the stages of the workflow share: one module per concern, from the recipe to the report."""

import os

# No file is written where others read it: files are moved into place whole. So HDF5 needs no locks, which some file
# systems do not have. Set here, since HDF5 looks only when it is loaded, and obeys this before any argument.
os.environ["HDF5_USE_FILE_LOCKING"] = "FALSE"
