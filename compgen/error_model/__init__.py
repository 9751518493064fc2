"""What makes the real arm differ from the nominal one."""
