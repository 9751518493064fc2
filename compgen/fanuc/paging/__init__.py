"""Programs longer than the controller holds, parted into pages."""
