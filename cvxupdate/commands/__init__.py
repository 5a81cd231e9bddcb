"""The commands that have a file of their own: wiring and command line of each, side by side."""
