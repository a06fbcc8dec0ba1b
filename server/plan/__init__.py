"""The open plan: its document, its edits, what workers compute of it, and what is shown of it."""
