"""Point clouds made into surface models: decoding in the confined child process, everything else here."""
