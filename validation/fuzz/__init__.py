"""Long random campaigns: whatever is put in, an answer or one message comes out (`make fuzz`)."""
