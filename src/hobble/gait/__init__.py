"""How a walk differs from a healthy one: its cycles, the sizes of effects, and which limp of people it is."""
