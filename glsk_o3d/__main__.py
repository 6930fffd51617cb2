"""The command ``glsk`` as ``python -m glsk_o3d``."""

from .cli.main import app

if __name__ == "__main__":
    app(prog_name="python -m glsk_o3d")
