"""The finger's dimensions, its profile, and the rules that a design must meet."""
