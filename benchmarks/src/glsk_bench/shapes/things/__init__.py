"""Things: shapes like those of real objects, of sweeps with flat or round ends, and hollow ones; eight families."""
