"""The parts of the clearance certificate: they import nothing that plans, so that the proof is independent."""
