"""What the stages of the workflow share: one module per concern, from the recipe to the report."""
