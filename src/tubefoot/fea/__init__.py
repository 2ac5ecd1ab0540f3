"""Hyperelastic finite elements with fluid cavities, for any mesh of points, cells and named sets."""
