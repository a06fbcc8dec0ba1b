"""What a pilot commands, carried out by one link: missions, navigation scripts, changes of mode."""
