"""What an image looks like to an eye: appearance and pictures."""
