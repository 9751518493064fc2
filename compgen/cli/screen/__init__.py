"""What is printed: messages, tables, progress."""
