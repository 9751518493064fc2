"""Programs beside a backup of the controller."""
