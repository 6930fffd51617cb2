"""The features of this processor that NumPy has code of its own for, as NPY_DISABLE_CPU_FEATURES takes them."""

try:
    from numpy._core._multiarray_umath import __cpu_dispatch__, __cpu_features__
except ImportError:  # before NumPy 2
    from numpy.core._multiarray_umath import __cpu_dispatch__, __cpu_features__

print(*(name for name in __cpu_dispatch__ if __cpu_features__[name]))  # NumPy warns of those that it lacks
