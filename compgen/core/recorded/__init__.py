"""Tables as loggers and measuring instruments write them, brought to the columns that compgen knows.

``cells`` reads names, units and numbers, ``times`` dates and clocks, ``sheets`` parts a file into rows, ``layout``
finds header and readings among them, ``table`` says which column is which. What a file leaves open is refused with the
line that settles it; nothing is guessed.
"""
