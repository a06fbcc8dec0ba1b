"""TI's millimetre-wave radars (AWR1843 and its kin) with the demo firmware of TI's SDK 2 and 3."""
