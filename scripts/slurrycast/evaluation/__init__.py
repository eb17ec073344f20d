"""The quality of predictions: noise of the DEM, error against cost, uncertainty."""
