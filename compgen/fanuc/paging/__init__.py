"""Programs longer than the controller holds, split into pages."""
