"""Flying: what is taken from the bus, kept, and published to the pages; and the desk from which a vehicle is flown."""
