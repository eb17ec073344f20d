"""What a prediction is worth: noise of the DEM, error against cost, uncertainty."""
