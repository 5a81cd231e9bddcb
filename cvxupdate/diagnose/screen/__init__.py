"""Which effects at which places are worth a refit: projected residual, short list, resampling."""
