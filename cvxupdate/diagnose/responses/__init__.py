"""Evidence from frequency responses and time histories."""
