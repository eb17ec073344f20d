"""Many recipes: where they lie, what their tapes are like in between, and which inputs matter."""
