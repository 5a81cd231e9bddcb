"""What a diagnosis says: sentences, the updated model, what the page draws."""
