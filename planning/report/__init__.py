"""The printable report of a plan: one page without script that loads nothing, and its figures."""
