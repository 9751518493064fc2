"""What a job does not know, as quantities, band and draws."""
