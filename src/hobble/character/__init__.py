"""How a character moves from one frame to the next, shared by runtime, training and measurements."""
