"""Turn an organic 3D shape into a construction kit whose pieces come in very few identical shapes."""

__version__ = "0.1.0"
