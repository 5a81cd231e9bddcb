"""The motion laboratory: time histories of structures that touch, rub, harden, drift, or do not."""
