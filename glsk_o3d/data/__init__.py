"""What flows between filters: points, their contraction, and skeletons; and the report that goes with them."""
