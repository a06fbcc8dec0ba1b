"""The product's version: files and certificates carry it."""

__version__ = "0.1.0"
