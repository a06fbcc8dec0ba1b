"""The surface model: reading it, its datum, its holes and spikes, and how it is shown."""
