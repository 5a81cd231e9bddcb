"""A laboratory of another hand: frames, plates and chains with rigs that are less polite."""
