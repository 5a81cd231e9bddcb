"""An independent laboratory: structures, rigs and recordings that share no code with the package,
and the judge of what `diagnose` says of them. ``make rigs``; docs/calibration.md."""
