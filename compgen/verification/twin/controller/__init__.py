"""The controller of the twin: what becomes of a written program in time, sample by sample, before the arm errs."""
