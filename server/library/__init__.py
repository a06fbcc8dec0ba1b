"""The data directory: surface models, orthophotos and plans as plain files that outlive any crash."""

from server.library.library import Library

__all__ = ["Library"]
