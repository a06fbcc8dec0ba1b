"""The papers' field tests in simulation: one process, virtual time, the very code that flies live."""
