"""Time histories at several levels, of structures whose internal forces no matrix can say."""
