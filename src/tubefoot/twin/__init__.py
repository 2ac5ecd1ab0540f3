"""Virtual counterparts of the bench: plants, and the real firmware in a simulated board."""
