"""The promises of docs/security.md, tried anew: ``make trust`` prints what is held, by which figure."""
