"""The steps of the refiner, one file each: a Skeleton in, a Skeleton out."""
