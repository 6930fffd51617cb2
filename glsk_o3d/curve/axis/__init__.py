"""The curve along the axis of the surface around it: the fit, its sections, the length of its edges."""
