"""An audit of what ``cgen generate`` leaves in a folder, by code and constants of its own.

    python -m tests.audit OUTPUT [PATH_FILE [ROBOT_FILE]]

Nothing here comes from the package or from its robot files. The constants are typed from the study, the maker's data
and the format's description (``study``), the program is read by another reader (``listing``), the arm is another DH
chain with Newton's method as inverse (``naive_arm``), the heat another integration (``heat``), the clock another one
(``clock``), the path another closed form (``curves``, ``surface``). Of the project it reads the path file, which says
what was wanted, and the folder, which says what was done. Lengths are mm, angles rad, times s, temperatures K.
"""
