"""The rest of a job in pages, corrected anew for what the robot is when a page starts."""
