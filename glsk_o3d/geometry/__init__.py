"""The formulas: arrays in, arrays out, NumPy and SciPy alone."""
