"""``python -m compgen``."""

from compgen.cli import main

main()
