"""Files of a vehicle over MAVLink FTP: its folders, and stretches of its files; sans-IO."""
