"""The command ``glsk``: one module per command, and what they share in `console`, `overrides` and `running`."""
