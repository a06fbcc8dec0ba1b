"""How the server works: worker processes and their jobs, nodes, tasks that end together, clocks and logs."""
