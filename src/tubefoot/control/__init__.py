"""Control: what a controller sees and says, the controllers, the estimator, the loop that drives a bench.

Nothing here knows whether the bench is real. Angles in rad, pressures in MPa, volumes in mm^3.
"""
