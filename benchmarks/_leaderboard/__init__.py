"""What other tools make of the public benchmark: kept scores, tables, a picture."""
