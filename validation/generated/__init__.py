"""Problems made from seeds, with a laboratory of their own."""
