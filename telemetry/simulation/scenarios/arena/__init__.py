"""Past two poles in a hall, by a tracked radar (Wessendorp 2021)."""
