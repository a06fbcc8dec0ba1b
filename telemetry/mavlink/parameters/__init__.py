"""The parameter protocol: single values, the whole list, and writing with read-back; sans-IO."""
