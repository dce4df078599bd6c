"""What runs in processes of its own: publishers, subscribers, and hoards of samples."""
