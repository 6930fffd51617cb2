"""What the core knows of other packages: who carries points, what is installed, how files are written."""
