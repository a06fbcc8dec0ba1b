"""The link node's application: connections, the one adopted vehicle, and the answers to all requests."""
