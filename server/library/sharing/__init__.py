"""The library between machines: pushed to a target, a folder or an object store, and pulled from it, by content."""
