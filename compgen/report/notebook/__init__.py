"""What a notebook works with: the functions of the package, and their results as arrays, tables, figures and files."""
