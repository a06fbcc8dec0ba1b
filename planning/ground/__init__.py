"""Ground: where a vehicle can drive and land on it, and a generated one to try Hedgehop on."""
