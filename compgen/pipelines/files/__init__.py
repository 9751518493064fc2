"""From files to a cell and a job: robot files, path files, parts, days."""
