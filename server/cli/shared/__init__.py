"""What several commands share: options, files, answers."""
