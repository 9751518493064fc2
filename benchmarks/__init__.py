"""What is fast, measured side by side; one thread a matrix product, as under the command."""

import compgen.cli.blas_threads  # noqa: F401  before numpy is loaded
