"""Studies of the package: accuracy, speed, other tools. Each is run by the script of its name in `benchmarks`."""
