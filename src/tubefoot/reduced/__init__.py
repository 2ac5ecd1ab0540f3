"""The reduced finger: one energy a unit, chained; NumPy only, so that a bench laptop can use it.

`law` is the energy of a unit, `chain` the answers of many units, `finger` their equilibria, `relaxation` the
memory of the wall, `files` the small versioned file in which `tubefoot reduce` leaves a finger.
"""
