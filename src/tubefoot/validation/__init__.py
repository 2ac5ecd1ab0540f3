"""Simulation against experiment: recordings of any lab, settled states, comparison, virtual experiments."""
