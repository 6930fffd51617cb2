"""The steps of the Refiner and the Tracer, a step a file: a Curve in, a Curve out.

All lengths are in the units of the cloud, unlike in the filters before, which work in a box of fixed size. So every
number of a step is a ratio, of lengths mostly: over a radius, a spacing or a distance.
"""
